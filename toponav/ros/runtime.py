"""The first lines of every ROS command: the right ROS 2, its messages, a context."""

import os
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from toponav.ros.environment import RosInstallation, prepare
from toponav.ros.interfaces import load_interfaces

__all__ = ["ros_context", "start"]


def start(on_build: Callable[[str], None] | None = None) -> RosInstallation:
    """Makes rclpy and every message package importable; the process may start again.

    Args:
        on_build: Told which message package is being built, when one is.

    Raises:
        InputError: There is no ROS 2, or a message package is missing and cannot be built.
    """
    found = prepare()
    load_interfaces(found, on_build)
    return found


@contextmanager
def ros_context(arguments: list[str] | None = None) -> Iterator[Any]:
    """rclpy between its beginning and its end; Ctrl-C and SIGTERM end it cleanly."""
    import rclpy
    from rclpy.signals import SignalHandlerOptions

    rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)

    def stop(_number: int, _frame: Any) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, stop)
    try:
        yield rclpy
    finally:
        signal.signal(signal.SIGTERM, before)
        if rclpy.ok():
            rclpy.shutdown()


def domain() -> int:
    """The DDS domain of this process: only nodes of one domain hear each other."""
    return int(os.environ.get("ROS_DOMAIN_ID", "0") or 0)
