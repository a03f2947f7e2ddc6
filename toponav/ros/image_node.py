"""An agent that looks for the place of a picture: the action GoToImage.

Call `toponav.ros.runtime.start` before importing this.
"""

import threading
import time
from collections.abc import Callable
from typing import Any, Final

import numpy as np
import rclpy
from geometry_msgs.msg import Twist, TwistStamped
from nav_msgs.msg import Odometry
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from sensor_msgs.msg import Image
from std_msgs.msg import Bool
from toponav_msgs.action import GoToImage

from toponav.core.episode import Velocity
from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.core.imagenav import (
    MAX_STEPS,
    PANORAMA_SHAPE,
    Action,
    ImageGoal,
    ImageNavAgent,
    PanoramaObservation,
)
from toponav.data.image_messages import color_of_image, depth_of_image, without_holes
from toponav.ros import _fill, _qos
from toponav.ros.conversions import Quaternion, yaw_of_quaternion
from toponav.ros.image_loop import ActionStep
from toponav.ros.presets import RobotPreset

__all__ = ["ImageNode"]

_STOP: Final = Velocity(0.0, 0.0)
_SIGNALS_S: Final = 0.2
_CONTROL_S: Final = 0.05
_FRESH_S: Final = 0.5
_FAULT_S: Final = 10.0
_MAX_DEPTH_M: Final = 10.0


class ImageNode(Node):  # type: ignore[misc]
    """Turns an agent's steps into velocities, as far as fresh odometry and pictures allow.

    Args:
        load_agent: Makes the agent.
        robot: Topic names and limits; `rgb` and `depth` are those of the panorama.
        wants_depth: Whether the agent compares depth too.
        use_sim_time: Whether time comes from /clock.
    """

    def __init__(
        self,
        load_agent: Callable[[], ImageNavAgent],
        robot: RobotPreset,
        wants_depth: bool,
        use_sim_time: bool,
    ) -> None:
        time_source = Parameter("use_sim_time", Parameter.Type.BOOL, use_sim_time)
        super().__init__("toponav_image_agent", parameter_overrides=[time_source])
        self._agent, self._robot, self._wants_depth = load_agent(), robot, wants_depth
        self._busy = threading.Lock()
        self._rgb: tuple[np.ndarray, float] | None = None
        self._depth: tuple[np.ndarray, float] | None = None
        self._odometry: tuple[Pose2, float] | None = None
        self._touching = False
        kind = TwistStamped if robot.stamped else Twist
        self._commands = self.create_publisher(kind, robot.cmd_vel, _qos.COMMAND)
        group = MutuallyExclusiveCallbackGroup()
        for topic, message, take, quality in (
            (robot.rgb, Image, self._on_rgb, _qos.SENSOR),
            (robot.depth, Image, self._on_depth, _qos.SENSOR),
            (robot.odom, Odometry, self._on_odometry, _qos.SENSOR),
            ("/bumper", Bool, self._on_bumper, _qos.SENSOR),
        ):
            self.create_subscription(message, topic, take, quality, callback_group=group)
        self._server = ActionServer(
            self,
            GoToImage,
            "go_to_image",
            self._go_to_image,
            goal_callback=lambda _: GoalResponse.ACCEPT,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
            callback_group=ReentrantCallbackGroup(),
        )

    def run(self) -> None:
        """Serve until ROS shuts down; the robot is told to stop at the end."""
        executor = MultiThreadedExecutor(num_threads=3)
        executor.add_node(self)
        try:
            # With a timeout: Python handles SIGTERM and Ctrl-C between two waits only.
            while rclpy.ok():
                executor.spin_once(timeout_sec=_SIGNALS_S)
        except ExternalShutdownException:
            pass
        finally:
            if rclpy.ok():
                self._send(_STOP)
            executor.shutdown(timeout_sec=1.0)

    def _now_s(self) -> float:
        seconds: float = self.get_clock().now().nanoseconds / 1e9
        return seconds

    def _send(self, command: Velocity) -> None:
        now_ns = self.get_clock().now().nanoseconds
        self._commands.publish(_fill.twist_message(command, self._robot.stamped, now_ns))

    def _on_rgb(self, message: Image) -> None:
        self._rgb = (rgb_of(message), _fill.stamp_ns(message.header) / 1e9)

    def _on_depth(self, message: Image) -> None:
        if self._wants_depth:
            self._depth = (depth_of(message), _fill.stamp_ns(message.header) / 1e9)

    def _on_odometry(self, message: Odometry) -> None:
        place, turned = message.pose.pose.position, message.pose.pose.orientation
        yaw = yaw_of_quaternion(Quaternion(turned.x, turned.y, turned.z, turned.w))
        self._odometry = (Pose2(place.x, place.y, yaw), self._now_s())

    def _on_bumper(self, message: Bool) -> None:
        self._touching = message.data

    def _go_to_image(self, handle: Any) -> Any:
        result = GoToImage.Result(outcome="rejected")
        if not self._busy.acquire(blocking=False):
            result.reason = "another goal is being driven to"
        else:
            try:
                result.outcome, result.reason, result.actions = self._drive(handle)
            except InputError as error:
                result.reason = str(error)
            except Exception as error:
                result.outcome, result.reason = "fault", f"the agent failed: {error!r}"
            finally:
                self._send(_STOP)
                self._busy.release()
        result.success = result.outcome == "stopped"
        if result.success:
            handle.succeed()
        elif result.outcome == "cancelled" and handle.is_cancel_requested:
            handle.canceled()
        else:
            handle.abort()
        return result

    def _drive(self, handle: Any) -> tuple[str, str, int]:
        goal = handle.request
        self._agent.reset(self._goal_of(goal))
        reseed = getattr(self._agent, "reseed", None)
        if reseed is not None:
            reseed(goal.seed)
        most = goal.max_actions or MAX_STEPS
        origin: Pose2 | None = None
        collided: bool | None = None
        moved_at_s = self._now_s()
        for number in range(most):
            seen, because = self._look(moved_at_s, handle)
            if seen is None:
                return because, because_words(because), number
            rgb, depth_m, odometry = seen
            origin = origin or odometry
            local = odometry.relative_to(origin)
            action = self._agent.act(PanoramaObservation(rgb, depth_m, local, collided, number))
            handle.publish_feedback(self._feedback(action, number + 1, most))
            if action is Action.STOP:
                return "stopped", "the agent says that it is there", number + 1
            collided, because = self._step(action, odometry, handle)
            if because:
                return because, because_words(because), number + 1
            moved_at_s = self._now_s()
        return "timeout", f"{most} actions have passed", most

    def _look(
        self, after_s: float, handle: Any
    ) -> tuple[tuple[np.ndarray, np.ndarray | None, Pose2] | None, str]:
        """A picture taken after the robot stood still again, or why there is none."""
        end_s = time.monotonic() + _FAULT_S
        while rclpy.ok() and time.monotonic() < end_s:
            if handle.is_cancel_requested:
                return None, "cancelled"
            rgb, depth, odometry = self._rgb, self._depth, self._odometry
            has_depth = not self._wants_depth or (depth is not None and depth[1] >= after_s)
            if rgb is not None and rgb[1] >= after_s and has_depth and odometry is not None:
                return (rgb[0], depth[0] if depth is not None else None, odometry[0]), ""
            time.sleep(0.01)
        return None, "fault"

    def _step(self, action: Action, start: Pose2, handle: Any) -> tuple[bool, str]:
        """Whether one action was blocked, and why the drive ends, if it does."""
        step = ActionStep(action, start, self._now_s(), self._robot.limits)
        stale_since_s: float | None = None
        while rclpy.ok():
            if handle.is_cancel_requested:
                return False, "cancelled"
            assert self._odometry is not None
            odometry, taken_s = self._odometry
            if self._now_s() - taken_s > _FRESH_S:
                stale_since_s = stale_since_s or time.monotonic()
                self._send(_STOP)
                if time.monotonic() - stale_since_s > _FAULT_S:
                    return False, "fault"
            else:
                stale_since_s = None
                command = step.command(odometry, self._now_s(), self._touching)
                self._send(command or _STOP)
                if command is None:
                    return step.blocked, ""
            time.sleep(_CONTROL_S)
        return False, "cancelled"

    def _goal_of(self, goal: Any) -> ImageGoal:
        rgb = rgb_of(goal.goal_image)
        depth_m = depth_of(goal.goal_depth) if goal.goal_depth.width else None
        if rgb.shape[:2] != PANORAMA_SHAPE:
            raise InputError(
                f"a goal picture has {PANORAMA_SHAPE[1]}x{PANORAMA_SHAPE[0]} pixels, "
                f"got {rgb.shape[1]}x{rgb.shape[0]}",
                where="GoToImage goal",
                remedy="give a panorama; its middle column looks ahead",
            )
        if self._wants_depth and depth_m is None:
            raise InputError(
                "this agent compares depth, and the goal has none",
                where="GoToImage goal, goal_depth",
                remedy="give the panorama's depth, or serve an agent of colour alone",
            )
        return ImageGoal(rgb, depth_m)

    def _feedback(self, action: Action, number: int, most: int) -> Any:
        belief = self._agent.belief()
        return GoToImage.Feedback(
            behavior=action.name.lower(),
            node="" if belief.node is None else str(belief.node),
            nodes=len(belief.nodes),
            actions=number,
            progress=number / most,
            stopped_because=belief.stopped_because,
        )


def rgb_of(message: Image) -> np.ndarray:
    """The colours of an image message."""
    return color_of_image(
        message.encoding, message.height, message.width, message.step, message.data
    )


def depth_of(message: Image) -> np.ndarray:
    """The metres of an image message, without NaN."""
    depth_m = depth_of_image(
        message.encoding,
        message.height,
        message.width,
        message.step,
        bool(message.is_bigendian),
        message.data,
    )
    return without_holes(depth_m, _MAX_DEPTH_M)


def because_words(outcome: str) -> str:
    """Why a drive ended, in words."""
    if outcome == "fault":
        return f"no fresh picture or odometry for {_FAULT_S:g} s"
    return "the goal was cancelled"
