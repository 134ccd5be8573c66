# SPDX-License-Identifier: BSD-3-Clause
"""ros2 launch tutti_ros server.launch.py state:=FOLDER: the server that joins the robots' maps; prints the bus for them.
With grid:=true a node beside it publishes the map to drive on."""
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess
from launch.conditions import IfCondition, UnlessCondition
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue


def generate_launch_description():
    value = LaunchConfiguration
    server = ["tutti", "server", "--state", value("state"), "--mission", value("mission"), "--set", ["closures.verifier=", value("verifier")]]
    return LaunchDescription([
        DeclareLaunchArgument("state", default_value="/tmp/tutti_server", description="folder of the map"),
        DeclareLaunchArgument("mission", default_value="tutti", description="name of the mission on the bus"),
        DeclareLaunchArgument("verifier", default_value="lidar", description="of closures, as the robots': lidar, visual, sensors"),
        DeclareLaunchArgument("ros", default_value="false",
                              description="the server itself publishes the map, by CycloneDDS, on this machine only: /world/map, /world/map_points (docs/ros.md)"),
        DeclareLaunchArgument("grid", default_value="false",
                              description="a node publishes the map, by this ROS: /world/map. Not beside ros:=true: the same topic"),
        ExecuteProcess(cmd=server, output="screen", condition=UnlessCondition(value("ros"))),
        ExecuteProcess(cmd=[*server, "--ros"], output="screen", condition=IfCondition(value("ros"))),
        Node(package="tutti_ros", executable="tutti_map", name="tutti_map", namespace="world", output="screen", respawn=True, respawn_delay=2.0,
             parameters=[{"map": ParameterValue(PathJoinSubstitution([value("state"), "map.tutti"]), value_type=str)}],
             condition=IfCondition(value("grid"))),
    ])
