# SPDX-License-Identifier: BSD-3-Clause
"""The package as colcon and ros2 launch take it: run by tutti_ros_test.py."""
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

import ros_stub
from paths import SOURCE, TUTTI

HERE = pathlib.Path(__file__).resolve().parent


class Package(unittest.TestCase):
    def test_it_installs_where_ros_looks(self):
        with tempfile.TemporaryDirectory() as folder:
            tree = pathlib.Path(folder) / "tutti"
            shutil.copytree(HERE.parent, tree / "ros2/tutti_ros", ignore=shutil.ignore_patterns("feed_pb2.py"))
            shutil.copytree(SOURCE / "proto", tree / "proto")
            if not shutil.which("protoc"):
                self.skipTest("protoc is not installed")
            done = subprocess.run([sys.executable, "setup.py", "-q", "install", "--prefix", f"{folder}/out",
                                   "--record", f"{folder}/files", "--single-version-externally-managed"],
                                  cwd=tree / "ros2/tutti_ros", capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, done.stderr)
            files = pathlib.Path(f"{folder}/files").read_text()
        for file in ("lib/tutti_ros/tutti_ros\n", "lib/tutti_ros/tutti_map\n", "tutti_ros/feed_pb2.py\n", "share/tutti_ros/package.xml\n",
                     "share/ament_index/resource_index/packages/tutti_ros\n", "launch/robot.launch.py\n",
                     "rviz/robot.rviz\n", "config/robot.yaml\n"):
            self.assertIn(file, files)

    def test_launch_files(self):
        """Against stubs that keep what they are given: arguments are declared before they are used, files are there."""
        made = []

        class Any:
            def __init__(self, *words, **named):
                self.words, self.named = words, named
                made.append(self)

        modules = {"ament_index_python.packages": ["get_package_share_directory"], "launch": ["LaunchDescription"],
                   "launch.actions": ["DeclareLaunchArgument", "EmitEvent", "ExecuteProcess", "RegisterEventHandler"],
                   "launch.event_handlers": ["OnProcessExit"], "launch.events": ["Shutdown"],
                   "launch.conditions": ["IfCondition", "UnlessCondition"],
                   "launch.substitutions": ["LaunchConfiguration", "PathJoinSubstitution", "PythonExpression"],
                   "launch_ros.actions": ["Node"], "launch_ros.parameter_descriptions": ["ParameterValue"]}
        kinds = {name: type(name, (Any,), {}) for names in modules.values() for name in names}
        kinds["get_package_share_directory"] = lambda name: str(HERE.parent)
        for module, names in modules.items():
            stub = sys.modules[module] = ros_stub.types.ModuleType(module)
            self.addCleanup(sys.modules.pop, module)
            stub.__dict__.update({name: kinds[name] for name in names})
        for file in ("robot", "server"):
            made.clear()
            code = (HERE.parent / f"launch/{file}.launch.py").read_text()
            space = {}
            exec(compile(code, file, "exec"), space)
            space["generate_launch_description"]()
            of = lambda kind: [x for x in made if type(x).__name__ == kind]
            declared = {x.words[0] for x in of("DeclareLaunchArgument")}
            self.assertEqual({x.words[0] for x in of("LaunchConfiguration")} - declared, set())
            told = [word for x in of("ExecuteProcess") for word in x.named["cmd"] if isinstance(word, str)]
            described = subprocess.run([TUTTI, told[1], "--help"], capture_output=True, text=True).stdout
            for word in told[2:]:
                self.assertIn(f" {word} ", described)
            for handler in of("OnProcessExit"):  # of a robot that is started wrongly, and of one that was killed
                at_exit = handler.named["on_exit"]
                self.assertIn("cannot be started", at_exit(ros_stub.types.SimpleNamespace(returncode=2), None)[0].named["event"].named["reason"])
                self.assertIsNone(at_exit(ros_stub.types.SimpleNamespace(returncode=-9), None))
            self.assertEqual(len(of("OnProcessExit")), 2 if file == "robot" else 0)
            for expression in [x.words[0] for x in of("PythonExpression") if "strip" in x.words[0][-1]]:
                for given, expected in (("r1", "r1"), ("/alpha", "alpha"), ("/fleet/alpha/", "fleet_alpha")):
                    said = "".join(word if isinstance(word, str) else given for word in expression)
                    self.assertEqual(eval(said), expected)
        self.assertTrue((HERE.parent / "config/robot.yaml").exists())
