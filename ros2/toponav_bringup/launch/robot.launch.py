"""The agent on a robot: ros2 launch toponav_bringup robot.launch.py map:=floor.topo.json."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, OpaqueFunction
from launch.substitutions import LaunchConfiguration

ARGUMENTS = {
    "robot": ("turtlebot4", "turtlebot4, turtlebot3, locobot or toponav"),
    "agent": ("graphnav_pf", "graphnav_pf, graphnav, phasenet or behavrnn"),
    "weights": ("", "folder of other weights; empty: those that ship"),
    "depth_topic": ("", "depth images, if not the robot's usual ones"),
    "info_topic": ("", "their camera_info"),
    "cmd_vel_topic": ("", "where commands go, if not the robot's usual topic"),
    "camera_height_m": ("", "height of the camera above the floor"),
    "max_linear_m_s": ("", "top speed, if lower than the robot's"),
    "max_angular_rad_s": ("", "top turn rate, if lower than the robot's"),
}


def agent_of(context):
    """The agent's process, with the options that were given."""
    command = ["toponav", "ros", "agent"]
    for name in ("map", *ARGUMENTS):
        value = LaunchConfiguration(name).perform(context)
        if value:
            command += ["--" + name.replace("_", "-"), value]
    return [ExecuteProcess(cmd=command, output="screen")]


def generate_launch_description():
    """The agent, with the robot's topic names and limits."""
    declared = [DeclareLaunchArgument("map", description="topological map (*.topo.json)")]
    for name, (default, text) in ARGUMENTS.items():
        declared.append(DeclareLaunchArgument(name, default_value=default, description=text))
    return LaunchDescription([*declared, OpaqueFunction(function=agent_of)])
