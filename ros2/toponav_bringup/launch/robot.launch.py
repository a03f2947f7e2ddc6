"""The agent on a robot: ros2 launch toponav_bringup robot.launch.py map:=floor.topo.json."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess
from launch.substitutions import LaunchConfiguration


def generate_launch_description():
    """The agent, with the robot's topic names and limits."""
    arguments = {
        "map": ("", "topological map (*.topo.json)"),
        "robot": ("turtlebot4", "turtlebot4, turtlebot3, locobot or toponav"),
        "agent": ("graphnav_pf", "graphnav_pf, graphnav, phasenet or behavrnn"),
    }
    command = ["toponav", "ros", "agent"]
    for name in arguments:
        command += [f"--{name}", LaunchConfiguration(name)]
    declared = [
        DeclareLaunchArgument(name, default_value=default, description=text)
        if default
        else DeclareLaunchArgument(name, description=text)
        for name, (default, text) in arguments.items()
    ]
    return LaunchDescription([*declared, ExecuteProcess(cmd=command, output="screen")])
