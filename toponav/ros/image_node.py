"""An agent that looks for the place of a picture: the action GoToImage.

Call `toponav.ros.runtime.start` before importing this.
"""

import threading
from collections.abc import Callable
from typing import Any, Final, NamedTuple

import rclpy
from geometry_msgs.msg import Twist, TwistStamped
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from toponav_msgs.action import GoToImage

from toponav.core.episode import Velocity
from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.core.imagenav import MAX_STEPS, Action, ImageNavAgent, PanoramaObservation
from toponav.ros import _fill, _qos
from toponav.ros.image_loop import ActionStep
from toponav.ros.panorama_node import PanoramaNode
from toponav.ros.pictures import goal_of
from toponav.ros.presets import RobotPreset

__all__ = ["ImageNode"]

_STOP: Final = Velocity(0.0, 0.0)
_SIGNALS_S: Final = 0.2
_FRESH_S: Final = 0.5
_FAULT_S: Final = 10.0
_NO_NEWS: Final = f"no fresh picture or odometry for {_FAULT_S:g} s"


class _End(NamedTuple):
    outcome: str
    reason: str


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
        super().__init__("toponav_image_agent")
        self._agent, self._robot, self._wants_depth = load_agent(), robot, wants_depth
        self._senses = PanoramaNode(robot, wants_depth, use_sim_time)
        self._busy = threading.Lock()
        self._closing = threading.Event()
        kind = TwistStamped if robot.stamped else Twist
        self._commands = self.create_publisher(kind, robot.cmd_vel, _qos.COMMAND)
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
        self._senses.begin()
        try:
            # With a timeout: Python handles SIGTERM and Ctrl-C between two waits only.
            while rclpy.ok():
                executor.spin_once(timeout_sec=_SIGNALS_S)
        except ExternalShutdownException:
            pass
        finally:
            self._closing.set()
            if rclpy.ok():
                self._send(_STOP)
            executor.shutdown(timeout_sec=1.0)
            self._senses.close()
            self._senses.destroy_node()

    def _send(self, command: Velocity) -> None:
        time_ns = self._senses.now_ns()
        self._commands.publish(_fill.twist_message(command, self._robot.stamped, time_ns))

    def _go_to_image(self, handle: Any) -> Any:
        result = GoToImage.Result(outcome="rejected")
        if not self._busy.acquire(blocking=False):
            result.reason = "another goal is being driven to"
        else:
            try:
                end = self._drive(handle, result)
                result.outcome, result.reason = end
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
        self.get_logger().info(f"{result.outcome}: {result.reason}")
        return result

    def _drive(self, handle: Any, result: Any) -> _End:
        goal = goal_of(handle.request, self._wants_depth)
        reseed = getattr(self._agent, "reseed", None)
        if reseed is not None:
            reseed(handle.request.seed)
        self._agent.reset(goal)
        most = handle.request.max_actions or MAX_STEPS
        origin: Pose2 | None = None
        collided: bool | None = None
        moved_at_s = self._senses.now_s()
        while result.actions < most:
            seen = self._senses.look(moved_at_s, _FAULT_S, lambda: self._is_over(handle))
            if seen is None:
                return self._end(handle)
            origin = origin or seen.odometry
            local = seen.odometry.relative_to(origin)
            action = self._agent.act(
                PanoramaObservation(seen.rgb, seen.depth_m, local, collided, result.actions)
            )
            result.actions += 1
            handle.publish_feedback(self._feedback(action, result.actions, most))
            if action is Action.STOP:
                because = self._agent.belief().stopped_because
                return _End("stopped", because or "the agent says that it is there")
            blocked = self._step(action, seen.odometry, handle)
            if blocked is None:
                return self._end(handle)
            collided, moved_at_s = blocked, self._senses.now_s()
        return _End("timeout", f"{most} actions have passed")

    def _step(self, action: Action, start: Pose2, handle: Any) -> bool | None:
        """Whether one action was blocked, or None where it could not be driven to its end."""
        senses = self._senses
        step = ActionStep(action, start, senses.now_s(), self._robot.limits)
        while not self._is_over(handle):
            odometry, age_s = senses.next_odometry()
            if odometry is None or age_s > _FRESH_S:
                self._send(_STOP)
                if age_s > _FAULT_S:
                    return None
                continue
            command = step.command(odometry, senses.now_s(), senses.touching)
            self._send(command or _STOP)
            if command is None:
                return step.blocked
        return None

    def _is_over(self, handle: Any) -> bool:
        return bool(handle.is_cancel_requested or self._closing.is_set() or not rclpy.ok())

    def _end(self, handle: Any) -> _End:
        if handle.is_cancel_requested:
            return _End("cancelled", "the goal was cancelled")
        if self._is_over(handle):
            return _End("cancelled", "ROS is shutting down")
        return _End("fault", _NO_NEWS)

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
