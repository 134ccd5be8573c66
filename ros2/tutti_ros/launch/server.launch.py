# SPDX-License-Identifier: BSD-3-Clause
"""ros2 launch tutti_ros server.launch.py state:=FOLDER: the server that joins the robots' maps; prints the bus for them."""
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess
from launch.conditions import IfCondition, UnlessCondition
from launch.substitutions import LaunchConfiguration


def generate_launch_description():
    value = LaunchConfiguration
    server = ["tutti", "server", "--state", value("state"), "--mission", value("mission")]
    return LaunchDescription([
        DeclareLaunchArgument("state", default_value="/tmp/tutti_server", description="folder of the map"),
        DeclareLaunchArgument("mission", default_value="tutti", description="name of the mission on the bus"),
        DeclareLaunchArgument("ros", default_value="false", description="publish the map: map, map_points (docs/ros.md)"),
        ExecuteProcess(cmd=server, output="screen", condition=UnlessCondition(value("ros"))),
        ExecuteProcess(cmd=[*server, "--ros"], output="screen", condition=IfCondition(value("ros"))),
    ])
