"""`toponav ros`: the simulator and the agents as ROS 2 nodes, recordings as bags."""

from collections.abc import Callable
from typing import Any

from toponav.cli._ros_agent import ros_agent
from toponav.cli._ros_clients import ros_find, ros_go, ros_picture, ros_put
from toponav.cli._ros_record import ros_record
from toponav.cli._ros_setup import start_ros
from toponav.cli._ros_simulator import ros_sim

__all__ = ["register", "ros_messages"]


def register() -> dict[tuple[str, ...], Callable[..., Any]]:
    """The commands of this module."""
    return {
        ("ros", "sim"): ros_sim,
        ("ros", "agent"): ros_agent,
        ("ros", "go"): ros_go,
        ("ros", "find"): ros_find,
        ("ros", "picture"): ros_picture,
        ("ros", "put"): ros_put,
        ("ros", "record"): ros_record,
        ("ros", "messages"): ros_messages,
    }


def ros_messages() -> int:
    """Build the ROS messages that have no wheel, once; other commands do it when needed.

    Example: toponav ros messages
    """
    from toponav.ros.interfaces import PACKAGES, cache_dir

    taken = start_ros()
    for package in PACKAGES:
        where = f"built in {cache_dir()}" if package in taken else "of this ROS 2"
        print(f"{package}: {where}")
    return 0
