"""`toponav ros go`, `find` and `picture`: what people ask of a robot."""

import json as json_module
import sys
from pathlib import Path
from typing import Annotated, Any

import tyro

from toponav.cli._ros_setup import Flag, Name, Robot, preset_of, start_ros, with_panorama
from toponav.core.errors import InputError

__all__ = ["ros_find", "ros_go", "ros_picture", "ros_put"]

_Number = Annotated[float, tyro.conf.Positional]
_Picture = Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="PICTURE")]


def ros_go(
    goal: Name,
    *,
    start: str,
    seed: int = 0,
    timeout_s: float = 30.0,
    json: Flag = False,
) -> int:
    """Send a robot that `toponav ros agent` drives to a node or room, and follow it there.

    Example: toponav ros go office_12 --start office_1

    Ctrl-C cancels the drive and stops the robot. Exit status 1 if it does not arrive.

    Args:
        goal: Node or room to reach.
        start: Node that the robot stands at, looking along the plan's first edge.
        seed: Seed of the agent's random numbers.
        timeout_s: How long to wait for an agent.
        json: Print the result as JSON.
    """
    start_ros()
    from toponav.ros.client import go
    from toponav.ros.runtime import ros_context

    with ros_context():
        result = go(start, goal, seed=seed, timeout_s=timeout_s, on_feedback=_show)
    return _tell(result, f"{result['progress']:.0%} of the plan", json)


def ros_find(
    picture: _Picture,
    *,
    seed: int = 0,
    max_actions: int = 0,
    timeout_s: float = 30.0,
    json: Flag = False,
) -> int:
    """Send a robot that `toponav ros agent --image-agent` drives to the place of a picture.

    Example: toponav ros find kitchen.png

    Ctrl-C cancels the drive and stops the robot. Exit status 1 if the agent does not say that it
    is there.

    Args:
        picture: A panorama (PNG, 512x128) as `toponav ros picture` makes it; its depth is read
            from NAME.depth.png beside it, where there is one.
        seed: Seed of the agent's random numbers.
        max_actions: Most steps of 0.25 m or 10 degrees; 0 means 500.
        timeout_s: How long to wait for an agent.
        json: Print the result as JSON.
    """
    if max_actions < 0:
        raise InputError(
            f"a number of actions is not negative: {max_actions}",
            where="--max-actions",
            remedy="leave it out",
        )
    start_ros()
    from toponav.ros.client import find
    from toponav.ros.pictures import read_goal
    from toponav.ros.runtime import ros_context

    goal = read_goal(picture)
    with ros_context():
        result = find(
            goal, seed=seed, max_actions=max_actions, timeout_s=timeout_s, on_feedback=_show
        )
    return _tell(result, f"{result['actions']} actions", json)


def ros_picture(
    *,
    out: Path,
    robot: Robot = "toponav",
    depth: Flag = False,
    timeout_s: float = 30.0,
) -> int:
    """Keep the panorama that a robot sees now, to be found later.

    Example: toponav ros picture --out kitchen.png --depth

    Args:
        out: The PNG to write.
        robot: Topic names of a known robot.
        depth: Keep its depth too, as NAME.depth.png: 16 bits of millimetres.
        timeout_s: How long to wait for a picture.
    """
    from toponav.core.files import check_out_file

    if out.suffix.lower() != ".png":
        raise InputError("a picture's name ends in .png", where=f"--out {out}", remedy="rename it")
    check_out_file(out)
    preset = with_panorama(preset_of(robot))
    start_ros()
    from toponav.ros.client import look
    from toponav.ros.pictures import write_goal
    from toponav.ros.runtime import ros_context

    with ros_context():
        goal = look(preset, depth, timeout_s)
    for path in write_goal(out, goal):
        print(path)
    return 0


def ros_put(
    x: _Number,
    y: _Number,
    yaw: _Number,
    *,
    timeout_s: float = 30.0,
) -> int:
    """Put the simulated robot down somewhere else, at rest.

    Example: toponav ros put 4.5 3.0 1.57

    Args:
        x: Metres.
        y: Metres.
        yaw: Radians.
        timeout_s: How long to wait for the simulator.
    """
    from toponav.core.geometry import Pose2

    start_ros()
    from toponav.ros.client import put
    from toponav.ros.runtime import ros_context

    with ros_context():
        put(Pose2(x, y, yaw), timeout_s)
    return 0


def _show(line: str) -> None:
    print(line, file=sys.stderr)


def _tell(result: dict[str, Any], how_far: str, json: bool) -> int:
    if json:
        print(json_module.dumps(result))
    else:
        print(f"{result['outcome']}: {result['reason']} ({how_far})")
    return 0 if result["success"] else 1
