# SPDX-License-Identifier: BSD-3-Clause
"""ros2 launch tutti_ros server.launch.py state:=FOLDER: the server that joins the robots' maps; prints the bus for them."""
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess
from launch.substitutions import LaunchConfiguration


def generate_launch_description():
    value = LaunchConfiguration
    return LaunchDescription([
        DeclareLaunchArgument("state", default_value="/tmp/tutti_server", description="folder of the map"),
        DeclareLaunchArgument("mission", default_value="tutti", description="name of the mission on the bus"),
        ExecuteProcess(cmd=["tutti", "server", "--state", value("state"), "--mission", value("mission")], output="screen"),
    ])
