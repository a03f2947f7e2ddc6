"""An agent as a ROS 2 node: the action FollowPlan against any robot with depth and cmd_vel.

Call `toponav.ros.runtime.start` before importing this.
"""

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
import rclpy
from geometry_msgs.msg import Twist, TwistStamped
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from toponav_msgs.action import FollowPlan
from visualization_msgs.msg import MarkerArray

from toponav.core.camera import PinholeCamera
from toponav.core.episode import Agent, Velocity, VelocityLimits
from toponav.core.errors import InputError
from toponav.maps.spec import TopologicalMap
from toponav.maps.task import NavigationTask
from toponav.ros import _fill, _qos
from toponav.ros.agent_loop import STOP, DriveConfig, DriveLoop, DriveResult, Progress
from toponav.ros.camera_node import CameraNode
from toponav.ros.markers import belief_markers, map_markers
from toponav.ros.presets import RobotPreset, robot_preset
from toponav.ros.tasks import task_of_goal
from toponav.ros.watchdog import Watchdog, WatchdogConfig

__all__ = ["AgentNode", "AgentNodeConfig"]

_NS: Final = 10**9
_SIGNALS_S: Final = 0.2
_WATCH_S: Final = 0.02
_WAIT_S: Final = 0.1


@dataclass(frozen=True)
class AgentNodeConfig:
    """What the node needs besides map and agent."""

    robot: RobotPreset = field(default_factory=lambda: robot_preset("toponav"))
    """Names of the robot's topics."""
    use_sim_time: bool = False
    """Whether time comes from /clock; commands then carry the stamp of the frame they answer."""
    watchdog: WatchdogConfig = field(default_factory=WatchdogConfig)
    drive: DriveConfig = field(default_factory=DriveConfig)


class AgentNode(Node):  # type: ignore[misc]
    """Drives a robot along plans, under a watchdog that runs in a thread of its own.

    Args:
        map_: The topological map.
        load_agent: Makes the agent, given the camera.
        camera: The camera that the agent was trained with, at this robot's height.
        config: Everything else.
    """

    def __init__(
        self,
        map_: TopologicalMap,
        load_agent: Callable[[PinholeCamera], Agent[NavigationTask]],
        camera: PinholeCamera,
        config: AgentNodeConfig,
    ) -> None:
        super().__init__("toponav_agent")
        self._map, self._camera, self.config = map_, camera, config
        self._eyes = CameraNode(config.robot, camera, config.use_sim_time)
        self._agent = load_agent(camera)
        self._warm_up()
        limits = config.robot.limits
        self.declare_parameter("max_linear_m_s", limits.linear_m_s)
        self.declare_parameter("max_angular_rad_s", limits.angular_rad_s)
        self._watchdog = Watchdog(config.watchdog)
        self._loop: DriveLoop | None = None
        self._asked_ns = 0
        self._busy = threading.Lock()
        self._sending = threading.Lock()
        self._closing = threading.Event()
        kind = TwistStamped if config.robot.stamped else Twist
        self._commands = self.create_publisher(kind, config.robot.cmd_vel, _qos.COMMAND)
        self._map_markers = self.create_publisher(MarkerArray, "~/markers", _qos.LATCHED)
        self._map_markers.publish(map_markers(map_, "map"))
        self._belief_markers = self.create_publisher(MarkerArray, "~/belief", _qos.LATCHED)
        self._server = ActionServer(
            self,
            FollowPlan,
            "follow_plan",
            self._follow_plan,
            goal_callback=self._accept,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
            callback_group=ReentrantCallbackGroup(),
        )
        self._watcher = threading.Thread(target=self._watch, name="watchdog", daemon=True)
        self._watcher.start()

    def run(self) -> None:
        """Serve until ROS shuts down; the robot is told to stop at the end."""
        # One thread drives, one answers cancellations and parameters; frames have their own.
        executor = MultiThreadedExecutor(num_threads=3)
        executor.add_node(self)
        self._eyes.begin()
        try:
            # With a timeout: Python handles SIGTERM and Ctrl-C between two waits only.
            while rclpy.ok():
                executor.spin_once(timeout_sec=_SIGNALS_S)
        except ExternalShutdownException:
            pass
        finally:
            self._closing.set()
            if rclpy.ok():
                self._send(STOP, None)
            executor.shutdown(timeout_sec=1.0)
            self._eyes.close()
            self._eyes.destroy_node()

    def _warm_up(self) -> None:
        """A first decision on a made-up frame, so that compiling delays no robot."""
        edge = self._map.edges[0]
        task = task_of_goal(self._map, nodes=(edge.source, edge.target))
        loop = DriveLoop(self._agent, task, DriveConfig(), Watchdog())
        rows = np.linspace(1.0, 2.0, self._camera.width, dtype=np.float32)
        frame = np.tile(rows, (self._camera.height, 1))
        for number in range(2):
            loop.step(frame + np.float32(number), float(number), lambda: 0.0)

    # Commands.

    def _send(self, command: Velocity, stamp_ns: int | None) -> None:
        time_ns = stamp_ns if stamp_ns is not None and self.config.use_sim_time else None
        if time_ns is None:
            # A nanosecond on: never the stamp of a frame, which this does not answer.
            time_ns = self._eyes.now_ns() + 1
        message = _fill.twist_message(command, self.config.robot.stamped, time_ns)
        with self._sending:
            self._commands.publish(message)

    def _watch(self) -> None:
        """Fifty times a second: zero velocity while something is wrong."""
        while not self._closing.wait(_WATCH_S):
            loop = self._loop
            if loop is None or not rclpy.ok():
                continue
            because = self._watchdog.fault(self._eyes.now_s())
            if because:
                loop.overrule(because)
                self._send(STOP, None)

    # The action.

    def _accept(self, _goal: Any) -> GoalResponse:
        self._asked_ns = self._eyes.now_ns()
        return GoalResponse.ACCEPT

    def _limits(self) -> VelocityLimits:
        linear = self.get_parameter("max_linear_m_s").value
        angular = self.get_parameter("max_angular_rad_s").value
        of_robot = self.config.robot.limits
        return VelocityLimits(
            min(max(linear, 0.0), of_robot.linear_m_s),
            min(max(angular, 0.0), of_robot.angular_rad_s),
            of_robot.linear_m_s2,
            of_robot.angular_rad_s2,
        )

    def _follow_plan(self, handle: Any) -> Any:
        if not self._busy.acquire(blocking=False):
            return self._finish(handle, _rejected("another goal is being driven to"))
        try:
            result = self._drive(handle)
        except InputError as error:
            result = _rejected(str(error))
        except Exception as error:
            self.get_logger().error(f"the agent failed: {error!r}")
            result = DriveResult("fault", f"the agent failed: {error!r}", "", 0.0, 0)
        finally:
            self._loop = None
            self._eyes.active = False
            self._send(STOP, None)
            self._busy.release()
        return self._finish(handle, result)

    def _drive(self, handle: Any) -> DriveResult:
        goal = handle.request
        task = task_of_goal(
            self._map, start=goal.start_node, goal=goal.goal, nodes=tuple(goal.nodes)
        )
        reseed = getattr(self._agent, "reseed", None)
        if reseed is not None:
            reseed(goal.seed)
        self._watchdog.start(self._eyes.now_s())
        drive = self.config.drive
        config = DriveConfig(
            self._limits(),
            drive.period_s,
            drive.arrived_steps,
            drive.fault_s,
            drive.timeout_s,
            self._camera.max_depth_m,
        )
        self._eyes.active = True
        self._loop = loop = DriveLoop(
            self._agent, task, config, self._watchdog, until_cancelled=goal.until_cancelled
        )
        return self._follow(handle, loop)

    def _follow(self, handle: Any, loop: DriveLoop) -> DriveResult:
        # With one clock for both, what was seen before the goal came is another drive's.
        last_ns = self._asked_ns - 1 if self.config.use_sim_time else -1
        self._eyes.forget()
        waiting_since_s = time.monotonic()
        while rclpy.ok() and not self._closing.is_set():
            if handle.is_cancel_requested:
                return loop.result("cancelled", "the goal was cancelled")
            frame = self._eyes.next_frame(last_ns, _WAIT_S)
            if frame is None:
                if time.monotonic() - waiting_since_s > loop.fault_s:
                    because = loop.stopped_because or _nothing_came(loop)
                    return loop.result("fault", because)
                continue
            last_ns, waiting_since_s = frame.stamp_ns, time.monotonic()
            stamp_s = frame.stamp_ns / _NS
            if not loop.wants(stamp_s):
                continue
            progress = loop.step(frame.depth_m, stamp_s, self._eyes.now_s)
            self._send(progress.command, frame.stamp_ns)
            handle.publish_feedback(_feedback(progress))
            if self._belief_markers.get_subscription_count():
                markers = belief_markers(loop.task, progress.belief, "map")
                self._belief_markers.publish(markers)
            ended = loop.ended(stamp_s)
            if ended is not None:
                return ended
        return loop.result("cancelled", "ROS is shutting down")

    def _finish(self, handle: Any, result: DriveResult) -> Any:
        if result.success:
            handle.succeed()
        elif result.outcome == "cancelled" and handle.is_cancel_requested:
            handle.canceled()
        else:
            handle.abort()
        message = FollowPlan.Result(success=result.success, outcome=result.outcome)
        message.reason, message.node = result.reason, result.node
        message.progress, message.steps = float(result.share), result.steps
        self.get_logger().info(f"{result.outcome}: {result.reason}")
        return message


def _nothing_came(loop: DriveLoop) -> str:
    if loop.steps == 0:
        return "no depth frame came, or no camera_info with it"
    return f"no depth frame for {loop.fault_s:g} s"


def _rejected(reason: str) -> DriveResult:
    return DriveResult("rejected", reason, "", 0.0, 0)


def _feedback(progress: Progress) -> Any:
    belief = progress.belief
    message = FollowPlan.Feedback(node=belief.node or "", edge=belief.edge or "")
    message.behavior = "" if belief.behavior is None else str(belief.behavior)
    message.edges = list(belief.edge_probability)
    message.probability = [float(each) for each in belief.edge_probability.values()]
    message.progress = float(progress.share)
    message.stopped_because = progress.stopped_because
    return message
