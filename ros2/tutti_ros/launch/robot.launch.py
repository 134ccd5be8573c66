# SPDX-License-Identifier: BSD-3-Clause
"""ros2 launch tutti_ros robot.launch.py namespace:=r1 odom:=odom points:=points fix:=fix bus:=nats://HOST:PORT"""
import os

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, EmitEvent, ExecuteProcess, RegisterEventHandler
from launch.conditions import IfCondition
from launch.event_handlers import OnProcessExit
from launch.events import Shutdown
from launch.substitutions import LaunchConfiguration, PythonExpression
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue


WRONG = 2  # exit code of both programs when their arguments cannot be: starting them again changes nothing


def ends_with(program, name):
    """Ends this launch when the program says that it is started wrongly."""
    def at_exit(event, _):
        if event.returncode == WRONG:
            return [EmitEvent(event=Shutdown(reason=f"{name} cannot be started like this: see what it says above"))]
        return None
    return RegisterEventHandler(OnProcessExit(target_action=program, on_exit=at_exit))


def generate_launch_description():
    value = LaunchConfiguration
    name = PythonExpression(["'", value("namespace"), "'.strip('/').replace('/', '_')"])  # '/alpha' and 'fleet/alpha' are namespaces
    arguments = {
        "namespace": ("r1", "of the robot, and, without slashes around it, its name in the map"),
        "odom": ("odom", "topic of nav_msgs/Odometry, relative to the namespace"),
        "points": ("points", "topic of sensor_msgs/PointCloud2, or of a Livox's CustomMsg, relative to the namespace"),
        "fix": ("fix", "topic of sensor_msgs/NavSatFix, relative to the namespace"),
        "tf": ("/tf", "topic of transforms: tf, where they are in the namespace"),
        "tf_static": ("/tf_static", "topic of transforms that do not move: tf_static, where they are in the namespace"),
        "images": ("", "topics of one camera or two, relative to the namespace: left/image_raw,right/image_raw; empty: none"),
        "depth": ("", "topic of depth images registered to the one camera; empty: none"),
        "imu": ("", "topic of sensor_msgs/Imu, which goes with images; empty: none"),
        "bus": ("", "nats://HOST:PORT as the server prints it; empty: tutti robot is started by somebody else"),
        "mission": ("tutti", "name of the mission on the bus, as the server's"),
        "verifier": ("lidar", "of closures, as the server's: lidar, visual (of images), sensors (of whatever two submaps both carry)"),
        "state": (["/tmp/tutti_", name], "folder that the robot keeps what it knows in"),
        "socket": ([value("state"), ".feed"], "of tutti robot --feed"),
        "params": (os.path.join(get_package_share_directory("tutti_ros"), "config", "robot.yaml"), "parameters"),
        "autostart": ("true", "false: tutti_ros waits for a lifecycle manager"),
        "use_sim_time": ("false", "the clock of /clock"),
    }
    declared = [DeclareLaunchArgument(argument, default_value=default, description=text)
                for argument, (default, text) in arguments.items()]
    robot = ExecuteProcess(
        cmd=["tutti", "robot", "--name", name, "--bus", value("bus"), "--mission", value("mission"),
             "--state", value("state"), "--feed", value("socket"), "--stay",
             "--set", ["closures.verifier=", value("verifier")]],
        output="screen", respawn=True, respawn_delay=2.0,
        condition=IfCondition(PythonExpression(["'", value("bus"), "' != ''"])))
    node = Node(
        package="tutti_ros", executable="tutti_ros", name="tutti_ros", namespace=value("namespace"), output="screen",
        respawn=True, respawn_delay=2.0,
        parameters=[{one: ParameterValue(value(one), value_type=str) for one in ("images", "depth", "imu")},
                    value("params"), {one: value(one) for one in ("socket", "use_sim_time", "autostart")}],
        remappings=[("odom", value("odom")), ("points", value("points")), ("fix", value("fix")),
                    ("/tf", value("tf")), ("/tf_static", value("tf_static"))])
    return LaunchDescription([*declared, ends_with(robot, "tutti robot"), ends_with(node, "tutti_ros"), robot, node])
