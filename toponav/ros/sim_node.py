"""The simulator as a ROS 2 robot. Call `toponav.ros.runtime.start` before importing this."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

import rclpy
from geometry_msgs.msg import PoseWithCovarianceStamped, Twist, TwistStamped
from nav_msgs.msg import OccupancyGrid, Odometry
from rclpy.node import Node
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Bool
from std_srvs.srv import SetBool
from tf2_msgs.msg import TFMessage
from toponav_msgs.srv import Reset, Seed, Step

from toponav.core.camera import PinholeCamera
from toponav.core.episode import Observation, Velocity
from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.data.image_messages import CameraModel
from toponav.ros import _fill, _qos
from toponav.ros.conversions import (
    OPTICAL_ROTATION,
    Quaternion,
    quaternion_of_yaw,
    time_parts,
    yaw_of_quaternion,
)
from toponav.ros.faults import FaultInjector, FaultSpec
from toponav.ros.presets import RobotPreset, robot_preset
from toponav.ros.simulated_robot import TICK_S, SimulatedRobot
from toponav.sim.simulation import CONTROL_PERIOD_S, SimState, Simulation

__all__ = ["FRAMES", "SimNode", "SimNodeConfig", "StepSeen"]


class _Frames(NamedTuple):
    """Names of coordinate frames (REP-105), and of the camera's (REP-103)."""

    map: str = "map"
    odom: str = "odom"
    footprint: str = "base_footprint"
    base: str = "base_link"
    camera: str = "camera_link"
    optical: str = "camera_depth_optical_frame"


FRAMES: Final = _Frames()
_NS: Final = 10**9
_ORIGIN: Final = (0.0, 0.0, 0.0)
_REPEAT_S: Final = 0.25
_MOST_KEPT: Final = 200_000


@dataclass(frozen=True)
class SimNodeConfig:
    """How the simulator behaves as a robot."""

    robot: RobotPreset = field(default_factory=lambda: robot_preset("toponav"))
    """Names of its topics."""
    rate: float = 1.0
    """Simulated seconds per second; 0 runs as fast as it can."""
    lockstep: bool = False
    """Whether a step waits for the command that answers the last frame, by its stamp."""
    faults: FaultSpec = field(default_factory=FaultSpec)
    """What is wrong with the camera."""
    fault_seed: int = 0
    paused: bool = False


class StepSeen(NamedTuple):
    """What a watcher is shown: the command and the truth after it."""

    command: Velocity
    state: SimState
    time_ns: int


class SimNode(Node):  # type: ignore[misc]
    """Publishes what a robot would, and drives as it is told.

    Args:
        simulation: Where the robot drives; its camera and modalities say what is published.
        start: Where it stands.
        config: How it behaves.
        on_step: Called after every tick, or step where in lock-step; it may call `reset`.
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
        self._simulation = simulation
        self._injector = FaultInjector(config.faults, config.fault_seed)
        self._odometry = _fill.odometry_message(FRAMES.odom, FRAMES.footprint)
        self._published_at_s: dict[int, float] = {}
        self.latencies_ms: list[float] = []
        """From the taking of a frame to the command that carries its stamp, wall time."""
        self.late_ticks = self.ticks = 0
        self.contacts: list[tuple[float, str]] = []
        """Simulated time and what was touched, once for each touch."""
        self._touching = False
        self._answer: Velocity | None = None
        self._awaited_ns = -1
        self._image: tuple[Observation, int] | None = None
        self._make_publishers()
        self._make_subscriptions()
        self._publish_static()
        self.publish_frame()

    def _make_publishers(self) -> None:
        robot, camera = self.config.robot, self._simulation.camera
        make = self.create_publisher
        self._clock = make(Clock, "/clock", _qos.RELIABLE)
        self._odom = make(Odometry, robot.odom, _qos.RELIABLE)
        self._tf = make(TFMessage, "/tf", _qos.RELIABLE)
        self._tf_static = make(TFMessage, "/tf_static", _qos.LATCHED)
        self._map = make(OccupancyGrid, "/map", _qos.LATCHED)
        self._bumper = make(Bool, "/bumper", _qos.RELIABLE)
        self._depth = make(Image, robot.depth, _qos.SENSOR)
        self._info = make(CameraInfo, robot.camera_info, _qos.SENSOR)
        self._info_message: CameraInfo | None = None
        if isinstance(camera, PinholeCamera):
            self._info_message = _fill.camera_info_message(CameraModel.of(camera), FRAMES.optical)
        self._rgb = self._rgb_info = None
        if "rgb" in self._simulation.modalities:
            self._rgb = make(Image, robot.rgb, _qos.SENSOR)
            self._rgb_info = make(
                CameraInfo, robot.rgb.rsplit("/", 1)[0] + "/camera_info", _qos.SENSOR
            )

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
            stamp, command = self._awaited_ns, _fill.velocity_of(message)
        since_s = self._published_at_s.pop(stamp, None)
        if since_s is not None and len(self.latencies_ms) < _MOST_KEPT:
            self.latencies_ms.append(1e3 * (now_s - since_s))
        if self.config.lockstep:
            if stamp == self._awaited_ns:
                self._answer = command
        else:
            self.robot.command(command)

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

    def reset(self, pose: Pose2 | None = None) -> None:
        """Put the robot down, and show what it sees there.

        Raises:
            InputError: The pose is not inside the building.
        """
        self.robot.reset(pose)
        self._answer = None
        self._published_at_s.clear()
        self.publish_state()
        self.publish_frame()

    def _publish_static(self) -> None:
        camera = self._simulation.camera
        height_m = camera.mount_height_m if camera is not None else 0.0
        pitch_rad = camera.pitch_rad if isinstance(camera, PinholeCamera) else 0.0
        tilt = Quaternion(0.0, math.sin(pitch_rad / 2), 0.0, math.cos(pitch_rad / 2))
        make = _fill.transform_message
        self._tf_static.publish(
            TFMessage(
                transforms=[
                    make(FRAMES.map, FRAMES.odom, _ORIGIN),
                    make(FRAMES.footprint, FRAMES.base, _ORIGIN),
                    make(FRAMES.base, FRAMES.camera, (0.0, 0.0, height_m), tilt),
                    make(FRAMES.camera, FRAMES.optical, _ORIGIN, OPTICAL_ROTATION),
                ]
            )
        )
        self._map.publish(_fill.map_message(self._simulation.scene, FRAMES.map))

    def publish_state(self) -> None:
        """Clock, odometry, transform and bumper."""
        time_ns, state = self.robot.time_ns, self.robot.state
        clock = Clock()
        clock.clock.sec, clock.clock.nanosec = time_parts(time_ns)
        self._clock.publish(clock)
        _fill.fill_odometry(self._odometry, state.pose, state.velocity, time_ns)
        self._odom.publish(self._odometry)
        x, y, yaw = state.pose
        turned = quaternion_of_yaw(yaw)
        moved = _fill.transform_message(FRAMES.odom, FRAMES.footprint, (x, y, 0.0), turned, time_ns)
        self._tf.publish(TFMessage(transforms=[moved]))
        touching = state.contact is not None
        if touching and not self._touching:
            self.contacts.append((time_ns / _NS, state.contact or ""))
        self._touching = touching
        self._bumper.publish(Bool(data=touching))

    def publish_frame(self) -> None:
        """Take a picture, and publish what the faulty camera lets through."""
        taken_s, time_ns = time.monotonic(), self.robot.time_ns
        seen = self.robot.observe()
        self._awaited_ns = time_ns
        self._published_at_s[time_ns] = taken_s
        while len(self._published_at_s) > 50:
            self._published_at_s.pop(next(iter(self._published_at_s)))
        self._injector.put(seen.depth_m, time_ns / _NS)
        self._image = (seen, time_ns)
        self._publish_due()
        if seen.rgb is not None and self._rgb is not None:
            self._rgb.publish(_fill.image_message(seen.rgb, "rgb8", FRAMES.optical, time_ns))
            self._publish_info(self._rgb_info, time_ns)

    def _publish_due(self) -> None:
        for taken_s, depth_m in self._injector.due(self.robot.time_ns / _NS):
            time_ns = round(taken_s * _NS)
            self._depth.publish(_fill.image_message(depth_m, "32FC1", FRAMES.optical, time_ns))
            self._publish_info(self._info, time_ns)

    def _publish_info(self, publisher: Any, time_ns: int) -> None:
        if self._info_message is not None:
            _fill.set_stamp(self._info_message.header, time_ns)
            publisher.publish(self._info_message)

    # Time.

    def tick(self) -> None:
        """A fiftieth of a second on."""
        done = self.robot.tick()
        self.ticks += 1
        self.publish_state()
        if done.frame_is_due:
            self.publish_frame()
        else:
            self._publish_due()
        self._tell(Velocity(0.0, 0.0), done.state)

    def _tell(self, command: Velocity, state: SimState) -> None:
        if self._on_step is not None:
            self._on_step(StepSeen(command, state, self.robot.time_ns))

    def run(self, until: Callable[[], bool] | None = None) -> None:
        """Serve until `until` says so, or ROS shuts down."""
        executor = rclpy.executors.SingleThreadedExecutor()
        executor.add_node(self)
        try:
            drive = self._run_lockstep if self.config.lockstep else self._run_clocked
            drive(executor, until or (lambda: False))
        finally:
            executor.remove_node(self)
            executor.shutdown()

    def _run_lockstep(self, executor: Any, until: Callable[[], bool]) -> None:
        shown_s = time.monotonic()
        while rclpy.ok() and not until():
            executor.spin_once(timeout_sec=0.05)
            if self._answer is not None:
                command, self._answer = self._answer, None
                state = self.robot.step(command)
                self.ticks += 1
                self.publish_state()
                self.publish_frame()
                shown_s = time.monotonic()
                self._tell(command, state)
            elif time.monotonic() - shown_s > _REPEAT_S:
                self._show_again()
                shown_s = time.monotonic()

    def _show_again(self) -> None:
        """For an agent that was not listening yet: the same frame, with the same stamp."""
        assert self._image is not None
        seen, time_ns = self._image
        self.publish_state()
        self._depth.publish(_fill.image_message(seen.depth_m, "32FC1", FRAMES.optical, time_ns))
        self._publish_info(self._info, time_ns)

    def _run_clocked(self, executor: Any, until: Callable[[], bool]) -> None:
        rate = self.config.rate
        due_s = time.monotonic()
        while rclpy.ok() and not until():
            if self.paused:
                executor.spin_once(timeout_sec=0.05)
                due_s = time.monotonic()
                continue
            executor.spin_once(timeout_sec=max(0.0, due_s - time.monotonic()))
            now_s = time.monotonic()
            if rate > 0 and now_s < due_s:
                continue
            if rate > 0 and now_s - due_s > TICK_S / rate:
                self.late_ticks += 1
                due_s = max(due_s, now_s - 10 * TICK_S / rate)
            self.tick()
            due_s = due_s + TICK_S / rate if rate > 0 else now_s
