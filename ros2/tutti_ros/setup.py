# SPDX-License-Identifier: BSD-3-Clause
"""Has protoc make the feed's messages of Tutti's own proto file, so that package and program cannot differ."""
import pathlib
import shutil
import subprocess
import tempfile

from setuptools import setup
from setuptools.command.build_py import build_py
from setuptools.command.develop import develop

HERE = pathlib.Path(__file__).resolve().parent  # also through the links of colcon build --symlink-install


def make_messages(folder):
    proto = HERE.parents[1] / "proto"
    with tempfile.TemporaryDirectory() as made:
        subprocess.run(["protoc", f"--python_out={made}", "-I", proto, proto / "tutti/v1/feed.proto"], check=True)
        shutil.copyfile(pathlib.Path(made) / "tutti/v1/feed_pb2.py", pathlib.Path(folder) / "feed_pb2.py")


class BuildWithMessages(build_py):
    def run(self):
        super().run()
        make_messages(pathlib.Path(self.build_lib) / "tutti_ros")

    def get_outputs(self, *more, **named):
        return [*super().get_outputs(*more, **named), str(pathlib.Path(self.build_lib) / "tutti_ros/feed_pb2.py")]


class DevelopWithMessages(develop):
    def run(self):
        make_messages(HERE / "tutti_ros")
        super().run()


setup(
    name="tutti_ros",
    version="0.2.0",
    packages=["tutti_ros"],
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/tutti_ros"]),
        ("share/tutti_ros", ["package.xml"]),
        ("share/tutti_ros/launch", ["launch/robot.launch.py", "launch/server.launch.py"]),
        ("share/tutti_ros/config", ["config/robot.yaml"]),
        ("share/tutti_ros/rviz", ["rviz/robot.rviz"]),
    ],
    install_requires=["setuptools", "protobuf", "numpy"],
    zip_safe=True,
    maintainer="The Tutti authors",
    maintainer_email="tutti@example.org",
    description="ROS 2 client of the live feed of a Tutti robot, and of the map of a Tutti server",
    license="BSD-3-Clause",
    entry_points={"console_scripts": ["tutti_ros = tutti_ros.node:main", "tutti_map = tutti_ros.map_node:main"]},
    cmdclass={"build_py": BuildWithMessages, "develop": DevelopWithMessages},
)
