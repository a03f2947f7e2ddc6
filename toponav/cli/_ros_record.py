"""`toponav ros record`: drives as bags."""

import sys
from contextlib import suppress
from pathlib import Path
from typing import Literal

from toponav.cli._map_files import load_any_map
from toponav.cli._ros_setup import Flag, Robot, preset_of, start_ros, trained_camera
from toponav.core.errors import InputError

__all__ = ["ros_record"]


def ros_record(
    *,
    map: Path,
    start: str,
    goal: str,
    out: Path,
    building: str = "floor",
    robot: Robot = "toponav",
    sim_time: Flag = False,
    seconds: float | None = None,
    outcome: Literal["success", "collided", "stuck", "timeout"] = "success",
) -> int:
    """Record a drive as a bag like those of `toponav collect`: depth, poses, commands at 5 Hz.

    Example: toponav ros record --map office.topo.json --start office_1 --goal office_12
    --out bags/000.mcap --robot turtlebot4

    Ctrl-C ends it and writes the file. `toponav data import-bag` makes a dataset of bags.

    Args:
        map: Topological map, or an area's yaml.
        start: Node that the robot stands at when the recording begins.
        goal: Node or room that it is driven to.
        out: The bag to write, ending in .mcap.
        building: Name of the building in the bag's metadata.
        robot: Topic names of a known robot.
        sim_time: Take time from /clock.
        seconds: End after so long.
        outcome: How the drive ended, for the metadata.
    """
    from toponav.core.files import check_out_file
    from toponav.ros.tasks import task_of_goal

    if out.suffix != ".mcap":
        raise InputError("a bag's name ends in .mcap", where=f"--out {out}", remedy="rename it")
    check_out_file(out)
    task = task_of_goal(load_any_map(map), start=start, goal=goal)
    preset = preset_of(robot)
    start_ros()
    from toponav.ros.record_node import RecordNode
    from toponav.ros.runtime import ros_context

    with ros_context():
        node = RecordNode(task, trained_camera(preset), preset, out, building, sim_time)
        print(f"recording to {out}; Ctrl-C ends it", file=sys.stderr)
        with suppress(KeyboardInterrupt):
            node.run(seconds)
        frames = node.finish(outcome)
    print(f"{frames} frames in {out}")
    return 0
