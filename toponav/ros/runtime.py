"""The first lines of every ROS command: the right ROS 2, its messages, a context."""

import gc
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Final

from toponav.ros.environment import RosInstallation, prepare
from toponav.ros.interfaces import load_interfaces

__all__ = ["favor_latency", "ros_context", "start"]

_TURN_S: Final = 0.0005


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


def favor_latency() -> None:
    """Threads of this process give way to each other sooner, and garbage is sought in less.

    Call it when everything is loaded. The thread that decides mostly waits for libraries, and
    Python hands it the interpreter back only at the end of another thread's turn: 5 ms, unless
    told otherwise.
    """
    sys.setswitchinterval(_TURN_S)
    gc.collect()
    gc.freeze()
