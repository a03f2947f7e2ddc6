"""`toponav data import-bag`: bags of any robot into a dataset."""

from pathlib import Path
from typing import Annotated, Literal

import tyro

__all__ = ["import_bag_"]


def import_bag_(
    bag: Annotated[Path, tyro.conf.Positional],
    *,
    out: Path,
    building: Path,
    start: str | None = None,
    goal: str | None = None,
    robot: Literal["toponav", "turtlebot4", "turtlebot3", "locobot"] = "toponav",
    depth_topic: str | None = None,
    info_topic: str | None = None,
    odom_topic: str | None = None,
    cmd_vel_topic: str | None = None,
    camera_height_m: float | None = None,
    outcome: Literal["success", "collided", "stuck", "timeout"] = "success",
) -> int:
    """Add the drive in a bag of any robot to a dataset; no ROS is needed.

    Example: toponav data import-bag drive_1 --out data/floor --building scenes/floor
    --start office_1 --goal kitchen --robot turtlebot4

    Call it once for each bag. `toponav train` takes the dataset beside others.

    Args:
        bag: An .mcap file, a rosbag2 folder or a ROS 1 .bag.
        out: Folder of the dataset; made where it is missing.
        building: Folder of the scene with its map.topo.json, or an area's yaml.
        start: Node that the robot stands at in the first frame, looking along the first edge.
        goal: Node or room that it was driven to.
        robot: Topic names of a known robot.
        depth_topic: Depth images, if not the preset's.
        info_topic: Their camera_info, if not the preset's.
        odom_topic: Odometry, if not the preset's.
        cmd_vel_topic: Commands, if not the preset's.
        camera_height_m: Height of the camera above the floor, if not the preset's.
        outcome: How the drive ended.
    """
    from toponav.cli._map_files import is_yaml, load_any_map
    from toponav.core.camera import PinholeCamera
    from toponav.core.errors import InputError
    from toponav.data.import_bag import BagTopics, import_bag
    from toponav.ros.presets import robot_preset
    from toponav.ros.tasks import task_of_goal

    if (start is None) != (goal is None):
        raise InputError(
            "--start and --goal go together",
            where="toponav data import-bag",
            remedy="give both, or neither for a bag of `toponav ros record`",
        )
    plan = None
    if start is not None and goal is not None:
        map_ = load_any_map(building if is_yaml(building) else building / "map.topo.json")
        plan = task_of_goal(map_, start=start, goal=goal).plan
    preset = robot_preset(robot)
    topics = BagTopics(
        depth_topic or preset.depth,
        info_topic or preset.camera_info,
        odom_topic or preset.odom,
        cmd_vel_topic or preset.cmd_vel,
    )
    height_m = camera_height_m if camera_height_m is not None else preset.camera_height_m
    manifest = import_bag(
        bag,
        out,
        building,
        plan,
        topics=topics,
        camera=PinholeCamera(mount_height_m=height_m),
        outcome=outcome,
    )
    print(f"{out}: {manifest.episodes} drives")
    return 0
