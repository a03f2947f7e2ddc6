"""Simulator, agent and RViz: ros2 launch toponav_bringup simulation.launch.py scene:=office ..."""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, Shutdown
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.substitutions import FindPackageShare


def generate_launch_description():
    """The simulated robot at a node of the map, its agent, and a window to watch them in."""
    text = {
        "scene": "folder of a scene, or an area's yaml",
        "map": "topological map (*.topo.json), or the area's yaml",
        "start": "node that the robot stands at",
    }
    scene, map_, start = (LaunchConfiguration(name) for name in text)
    layout = PathJoinSubstitution([FindPackageShare("toponav_bringup"), "config", "toponav.rviz"])
    simulator = ["toponav", "ros", "sim", "--scene", scene, "--map", map_, "--start", start]
    return LaunchDescription(
        [
            *(DeclareLaunchArgument(name, description=what) for name, what in text.items()),
            DeclareLaunchArgument("rviz", default_value="true", description="whether to open it"),
            ExecuteProcess(cmd=simulator, output="screen", on_exit=Shutdown()),
            ExecuteProcess(
                cmd=["toponav", "ros", "agent", "--map", map_, "--sim-time"], output="screen"
            ),
            ExecuteProcess(
                cmd=["rviz2", "-d", layout],
                condition=IfCondition(LaunchConfiguration("rviz")),
            ),
        ]
    )
