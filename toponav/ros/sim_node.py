"""The simulator as a ROS 2 robot. Call `toponav.ros.runtime.start` before importing this."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

import numpy as np
import rclpy
from geometry_msgs.msg import PoseWithCovarianceStamped, Twist, TwistStamped
from rclpy.node import Node
from std_srvs.srv import SetBool
from toponav_msgs.srv import Reset, Seed, Step

from toponav.core.episode import Velocity
from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.ros import _fill, _qos
from toponav.ros.conversions import Quaternion, yaw_of_quaternion
from toponav.ros.faults import FaultInjector, FaultSpec
from toponav.ros.presets import RobotPreset, robot_preset
from toponav.ros.robot_topics import RobotTopics
from toponav.ros.simulated_robot import TICK_S, Pace, SimulatedRobot
from toponav.sim.simulation import CONTROL_PERIOD_S, SimState, Simulation

__all__ = ["SimNode", "SimNodeConfig", "StepSeen"]


_NS: Final = 10**9
_REPEAT_S: Final = 0.25
_IDLE_S: Final = 0.05
_MOST_KEPT: Final = 200_000
_MOST_AWAITED: Final = 50


@dataclass(frozen=True)
class SimNodeConfig:
    """How the simulator behaves as a robot."""

    robot: RobotPreset = field(default_factory=lambda: robot_preset("toponav"))
    """Names of its topics."""
    rate: float = 1.0
    """Simulated seconds per second; 0 runs as fast as it can."""
    lockstep: bool = False
    """Whether time stands still until a command has answered the last frame, by its stamp."""
    faults: FaultSpec = field(default_factory=FaultSpec)
    """What is wrong with the camera."""
    fault_seed: int = 0
    paused: bool = False


class StepSeen(NamedTuple):
    """What a watcher is shown of a tick.

    Attributes:
        command: What the robot did.
        state: The truth after it.
        time_ns: The clock.
        ends_step: Whether a control step of 0.2 s has passed, and a picture was taken.
    """

    command: Velocity
    state: SimState
    time_ns: int
    ends_step: bool


class _Shown(NamedTuple):
    depth_m: np.ndarray
    time_ns: int
    at_s: float


class SimNode(Node):  # type: ignore[misc]
    """Publishes what a robot would, and drives as it is told.

    Args:
        simulation: Where the robot drives; its camera and modalities say what is published.
        start: Where it stands.
        config: How it behaves.
        on_step: Called after every tick; it may call `reset`.
    """

    def __init__(
        self,
        simulation: Simulation,
        start: Pose2,
        config: SimNodeConfig,
        on_step: Callable[[StepSeen], None] | None = None,
    ) -> None:
        super().__init__("toponav_sim")
        self.robot = SimulatedRobot(simulation, start)
        self.config, self.paused, self._on_step = config, config.paused, on_step
        self._injector = FaultInjector(config.faults, config.fault_seed)
        self._pace = Pace(config.rate)
        self._published_at_s: dict[int, float] = {}
        self.latencies_ms: list[float] = []
        """From the taking of a frame to the command that carries its stamp, wall time."""
        self.late_ticks = self.ticks = 0
        self.contacts: list[tuple[float, str]] = []
        """Simulated time and what was touched, once for each touch."""
        self._touching = False
        self._awaited_ns: int | None = None
        self._newest_ns = -1
        self._shown: _Shown | None = None
        self._topics = RobotTopics(self, simulation, config.robot)
        self._make_subscriptions()
        self.take_picture()

    def _make_subscriptions(self) -> None:
        kind = TwistStamped if self.config.robot.stamped else Twist
        topic, other = self.config.robot.cmd_vel, Twist
        self.create_subscription(kind, topic, self._on_command, _qos.RELIABLE)
        if kind is TwistStamped:
            # One topic has one type in ROS 2: the other type has a topic of its own.
            self.create_subscription(other, f"{topic}_unstamped", self._on_command, _qos.RELIABLE)
        self.create_subscription(
            PoseWithCovarianceStamped, "/initialpose", self._on_initial_pose, _qos.RELIABLE
        )
        self.create_service(Reset, "~/reset", self._on_reset)
        self.create_service(Seed, "~/seed", self._on_seed)
        self.create_service(SetBool, "~/pause", self._on_pause)
        self.create_service(Step, "~/step", self._on_step_service)

    # What comes in.

    def _on_command(self, message: Any) -> None:
        now_s = time.monotonic()
        if isinstance(message, TwistStamped):
            stamp, command = _fill.stamp_ns(message.header), _fill.velocity_of(message.twist)
        else:
            # A Twist says no time: it answers what was shown last.
            stamp, command = self._newest_ns, _fill.velocity_of(message)
        since_s = self._published_at_s.pop(stamp, None)
        if since_s is not None and len(self.latencies_ms) < _MOST_KEPT:
            self.latencies_ms.append(1e3 * (now_s - since_s))
        self.robot.command(command)
        if stamp == self._awaited_ns:
            self._awaited_ns = None

    def _on_initial_pose(self, message: Any) -> None:
        place = message.pose.pose
        turned = place.orientation
        yaw = yaw_of_quaternion(Quaternion(turned.x, turned.y, turned.z, turned.w))
        try:
            self.reset(Pose2(place.position.x, place.position.y, yaw))
        except InputError as error:
            self.get_logger().warning(str(error))

    def _on_reset(self, request: Any, response: Any) -> Any:
        try:
            self.reset(Pose2(request.x, request.y, request.yaw))
        except InputError as error:
            response.success, response.message = False, str(error)
        else:
            response.success, response.message = True, ""
        return response

    def _on_seed(self, request: Any, response: Any) -> Any:
        self.robot.seed(request.seed)
        response.success = True
        return response

    def _on_pause(self, request: Any, response: Any) -> Any:
        self.paused = request.data
        response.success = True
        return response

    def _on_step_service(self, request: Any, response: Any) -> Any:
        if not self.paused or self.config.lockstep:
            response.message = "pause the simulation first; in lock-step, commands step it"
        else:
            for _ in range(round(request.steps * CONTROL_PERIOD_S / TICK_S)):
                self.tick()
            response.success = True
        response.time_s = self.robot.time_ns / _NS
        return response

    # What goes out.

    def configure(self, config: SimNodeConfig) -> None:
        """Behave like this from now on; the topics stay what they are."""
        if config.faults != self.config.faults:
            self._injector = FaultInjector(config.faults, config.fault_seed)
        if config.rate != self.config.rate:
            self._pace = Pace(config.rate)
        self.config = config

    def reset(self, pose: Pose2 | None = None) -> None:
        """Put the robot down, and show what it sees there.

        Raises:
            InputError: The pose is not inside the building.
        """
        self.robot.reset(pose)
        self._awaited_ns = None
        self._injector.clear()
        self._published_at_s.clear()
        self.show_state()
        self.take_picture()

    def show_state(self) -> None:
        """Clock, odometry, transform and bumper; a touch is noted."""
        state, time_ns = self.robot.state, self.robot.time_ns
        self._topics.show_state(state, time_ns)
        touching = state.contact is not None
        if touching and not self._touching:
            self.contacts.append((time_ns / _NS, state.contact or ""))
        self._touching = touching

    def take_picture(self) -> None:
        """Take a picture, and show what the faulty camera lets through."""
        taken_s, time_ns = time.monotonic(), self.robot.time_ns
        seen = self.robot.observe()
        self._published_at_s[time_ns] = taken_s
        while len(self._published_at_s) > _MOST_AWAITED:
            self._published_at_s.pop(next(iter(self._published_at_s)))
        self._injector.put(seen.depth_m, time_ns / _NS)
        self._show_due()
        if seen.rgb is not None:
            self._topics.show_rgb(seen.rgb, time_ns)

    def _show_due(self) -> None:
        for taken_s, depth_m in self._injector.due(self.robot.time_ns / _NS):
            self._awaited_ns = self._newest_ns = round(taken_s * _NS)
            self._show(depth_m, self._newest_ns)

    def _show(self, depth_m: np.ndarray, time_ns: int) -> None:
        self._topics.show_depth(depth_m, time_ns)
        self._shown = _Shown(depth_m, time_ns, time.monotonic())

    # Time.

    def tick(self) -> None:
        """A fiftieth of a second on."""
        done = self.robot.tick()
        self.ticks += 1
        now_s = self.robot.time_ns / _NS
        # In lock-step the clock goes from frame to frame: nobody needs to hear it in between.
        if not self.config.lockstep or done.frame_is_due or self._injector.is_due(now_s):
            self.show_state()
        if done.frame_is_due:
            self.take_picture()
        else:
            self._show_due()
        if self._on_step is not None:
            seen = StepSeen(done.command, done.state, self.robot.time_ns, done.frame_is_due)
            self._on_step(seen)

    def run(self, until: Callable[[], bool] | None = None) -> None:
        """Serve until `until` says so, or ROS shuts down."""
        executor = rclpy.executors.SingleThreadedExecutor()
        executor.add_node(self)
        is_over = until or (lambda: False)
        self._pace.restart()
        try:
            while rclpy.ok() and not is_over():
                if self.paused or self._is_waiting():
                    executor.spin_once(timeout_sec=_IDLE_S)
                    self._show_again_if_unanswered()
                    self._pace.restart()
                    continue
                executor.spin_once(timeout_sec=self._pace.left_s())
                if self._pace.left_s() == 0.0 and not self._is_waiting():
                    self.late_ticks += self._pace.tick()
                    self.tick()
        finally:
            executor.remove_node(self)
            executor.shutdown()

    def _is_waiting(self) -> bool:
        return self.config.lockstep and self._awaited_ns is not None

    def _show_again_if_unanswered(self) -> None:
        """For an agent that was not listening yet: the same frame, with the same stamp."""
        if self._shown is None or not self._is_waiting():
            return
        depth_m, time_ns, shown_s = self._shown
        if time.monotonic() - shown_s > _REPEAT_S:
            self.show_state()
            self._show(depth_m, time_ns)
