"""A robot in a building: velocity commands in, poses, contacts and depth images out."""

import dataclasses
import math
from collections.abc import Sequence
from typing import NamedTuple

import mujoco
import numpy as np

from toponav.core.camera import Camera
from toponav.core.episode import Observation, Velocity, VelocityLimits
from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.sim.physics import build_model
from toponav.sim.render import DepthRenderer, check_backend, check_modalities, make_renderer
from toponav.sim.robots import TURTLEBOT2, DifferentialRobot
from toponav.sim.sensor_noise import DepthSensor, DepthSensorNoise
from toponav.worlds.scene import Scene, SemanticClass

__all__ = ["CONTROL_PERIOD_S", "TIMESTEP_S", "PhysicsError", "SimState", "Simulation"]

CONTROL_PERIOD_S = 0.2
"""Time between commands: GraphNav runs at 5 Hz."""

TIMESTEP_S = 0.004
"""Time between two states of the physics."""
_SUBSTEPS = round(CONTROL_PERIOD_S / TIMESTEP_S)
_SETTLE_STEPS = 250
_UPRIGHT = math.cos(math.radians(20.0))


class PhysicsError(RuntimeError):
    """The physics lost the robot: it tipped over or its state stopped being finite."""


class SimState(NamedTuple):
    """The truth after one control step.

    Attributes:
        pose: Where the robot is.
        velocity: How it moves, in its own frame.
        contact: What its body touched at any moment of the step (`wall`, `furniture`, any
            `SemanticClass` in lower case), or None.
        time_s: Seconds since the reset.
    """

    pose: Pose2
    velocity: Velocity
    contact: str | None
    time_s: float


class Simulation:
    """A differential-drive robot with a camera, deterministic to the byte.

    A simulation that was reset equals a fresh one: the same commands give the same states.
    One instance serves one thread; build one per worker.

    Args:
        scene: The building.
        camera: The camera, or None for a robot that will never be asked what it sees.
        limits: Speed and acceleration limits, applied to every command.
        backend: Which renderer to use, as in `make_renderer`.
        robot: The robot.
        modalities: What `observe` gives besides depth: any of `rgb`, `semantic` and `instance`.
        sensor: A depth sensor whose errors depth has, such as `depth_sensor("kinect_v1")`; None
            for the truth.
        sensor_seed: Seed of the sensor's errors; the same step of the same commands errs alike.

    Example:
        >>> simulation = Simulation(scene, PinholeCamera())
        >>> state = simulation.reset(Pose2(1.0, 2.0, 0.0))
        >>> state = simulation.step(Velocity(0.5, 0.0))
        >>> depth_m = simulation.observe().depth_m
    """

    def __init__(
        self,
        scene: Scene,
        camera: Camera | None = None,
        limits: VelocityLimits = VelocityLimits(),  # noqa: B008 - frozen
        backend: str = "auto",
        robot: DifferentialRobot = TURTLEBOT2,
        modalities: Sequence[str] = ("depth",),
        sensor: DepthSensor | None = None,
        sensor_seed: int = 0,
    ) -> None:
        check_backend(backend)
        check_modalities(modalities)
        self.scene = scene
        self.camera = camera
        self.limits = limits
        self.robot = robot
        self.modalities = tuple(modalities)
        self.sensor = sensor
        self.sensor_seed = sensor_seed
        self._noise = (
            None if sensor is None or camera is None else DepthSensorNoise(sensor, camera)
        )
        self._backend = backend
        self._renderer: DepthRenderer | None = None
        building = build_model(scene, robot, TIMESTEP_S)
        self._model = building.model
        self._body_geom = building.body_geom
        self._box_semantic = building.box_semantic
        self._data = mujoco.MjData(self._model)
        self._state: SimState | None = None
        self._setpoint = (0.0, 0.0)
        self._substeps = 0
        self._rest_height_m, self._rest_pitch_rad = self._settle()

    def reset(self, pose: Pose2) -> SimState:
        """The robot at rest on the floor at `pose`, and the clock at zero.

        `contact` says when it stands in something.

        Raises:
            InputError: If the pose is not finite or not inside the building.
        """
        if not all(map(math.isfinite, pose)) or not self.scene.grid.contains(*pose[:2]):
            raise InputError(
                f"a robot must start inside the scene, got {tuple(pose)}",
                where=f"scene {self.scene.name}",
                remedy="pick a pose in the scene's free space",
            )
        self._place(pose, self._rest_height_m, self._rest_pitch_rad)
        self._setpoint = (0.0, 0.0)
        self._substeps = 0
        self._state = self._measure(self._touched())
        return self._state

    def step(self, command: Velocity) -> SimState:
        """The state after driving for one control period.

        The command is clipped to the speed limits and approached at the acceleration limits.

        Raises:
            InputError: If the command is not finite, or nothing was reset yet.
            PhysicsError: If the robot tips over.
        """
        return self.advance(command, _SUBSTEPS)

    def advance(self, command: Velocity, substeps: int, *, brakes: bool = False) -> SimState:
        """The state after driving for so many physics steps of `TIMESTEP_S`.

        Args:
            command: As `step` takes it.
            substeps: How many; `step` takes 50.
            brakes: Whether the wheels are told the command at once, as a base does that stops
                because nobody commands it any more; the wheels' torque is the limit then.

        Raises:
            InputError: As `step` does.
            PhysicsError: As `step` does.
        """
        self._require_state()
        if not (math.isfinite(command.linear_m_s) and math.isfinite(command.angular_rad_s)):
            raise InputError(
                f"a velocity must be finite, got ({command.linear_m_s}, {command.angular_rad_s})",
                where=f"control step {self._substeps // _SUBSTEPS}",
                remedy="stop the robot instead of sending what was computed",
            )
        goal = self.limits.clip(command)
        contact: str | None = None
        found = self._data.sensordata
        for _ in range(substeps):
            self._ramp(goal, brakes)
            mujoco.mj_step(self._model, self._data)
            if contact is None and found[0] > 0:
                contact = self._touched()
        self._substeps += substeps
        self._state = self._measure(contact)
        return self._state

    @property
    def state(self) -> SimState:
        """The state after the last reset or step."""
        return self._require_state()

    def observe(self) -> Observation:
        """What the camera sees now; rendered when asked and not before.

        Raises:
            InputError: If the robot has no camera, or nothing was reset yet.
        """
        state = self._require_state()
        others = [name for name in self.modalities if name != "depth"]
        if not others:
            depth_m, rgb, semantic, instance = self.renderer.render(state.pose), None, None, None
        else:
            seen = self.renderer.render_images(state.pose, ("depth", *others))
            rgb, semantic, instance = seen.rgb, seen.semantic, seen.instance
            assert seen.depth_m is not None
            depth_m = seen.depth_m
        if self._noise is not None:
            seed = [self.sensor_seed, self._substeps // _SUBSTEPS]
            depth_m = self._noise(depth_m, np.random.default_rng(seed), rgb)
        return Observation(depth_m, state.time_s, rgb, semantic, instance)

    @property
    def renderer(self) -> DepthRenderer:
        """The camera's renderer, made on first use."""
        if self._renderer is None:
            if self.camera is None:
                raise InputError(
                    "this robot has no camera",
                    where=f"scene {self.scene.name}",
                    remedy="pass a PinholeCamera or a PanoramaCamera to Simulation",
                )
            camera = self.camera
            if self._noise is not None:
                camera = dataclasses.replace(camera, max_depth_m=self._noise.renders_to_m)
            self._renderer = make_renderer(self.scene, camera, self._backend)
        return self._renderer

    def _require_state(self) -> SimState:
        if self._state is None:
            raise InputError(
                "a simulation begins with a pose",
                where=f"scene {self.scene.name}",
                remedy="call reset(pose) first",
            )
        return self._state

    def _ramp(self, goal: Velocity, brakes: bool) -> None:
        """Moves the wheels' setpoints towards the command by what one physics step allows."""
        linear, angular = self._setpoint
        if linear == goal.linear_m_s and angular == goal.angular_rad_s:
            return
        if brakes:
            linear, angular = goal.linear_m_s, goal.angular_rad_s
        else:
            linear = _approach(linear, goal.linear_m_s, self.limits.linear_m_s2 * TIMESTEP_S)
            angular = _approach(
                angular, goal.angular_rad_s, self.limits.angular_rad_s2 * TIMESTEP_S
            )
        self._setpoint = (linear, angular)
        turn = angular * self.robot.wheel_separation_m / 2
        control = self._data.ctrl
        control[0] = (linear - turn) / self.robot.wheel_radius_m
        control[1] = (linear + turn) / self.robot.wheel_radius_m

    def _settle(self) -> tuple[float, float]:
        """Height and pitch of the robot when it stands still, found outside the building."""
        left, _, bottom, _ = self.scene.grid.extent_m
        self._place(Pose2(left - 5.0, bottom - 5.0, 0.0), self.robot.wheel_radius_m, 0.0)
        mujoco.mj_step(self._model, self._data, nstep=_SETTLE_STEPS)
        height_m = float(self._data.qpos[2])
        w, _, y, _ = self._data.qpos[3:7].tolist()
        return height_m, 2.0 * math.atan2(y, w)

    def _place(self, pose: Pose2, height_m: float, pitch_rad: float) -> None:
        data = self._data
        mujoco.mj_resetData(self._model, data)
        half_yaw, half_pitch = pose.yaw_rad / 2, pitch_rad / 2
        data.qpos[:3] = (pose.x_m, pose.y_m, height_m)
        data.qpos[3:7] = (
            math.cos(half_yaw) * math.cos(half_pitch),
            -math.sin(half_yaw) * math.sin(half_pitch),
            math.cos(half_yaw) * math.sin(half_pitch),
            math.sin(half_yaw) * math.cos(half_pitch),
        )
        mujoco.mj_forward(self._model, data)

    def _touched(self) -> str | None:
        """What the body touches now: structure only when nothing else is touched."""
        contacts = self._data.contact.geom
        touched = contacts[(contacts == self._body_geom).any(axis=1)]
        if touched.size == 0:
            return None
        return SemanticClass(int(self._box_semantic[touched].max())).name.lower()

    def _measure(self, contact: str | None) -> SimState:
        x, y, z, qw, qx, qy, qz = self._data.qpos[:7].tolist()
        vx, vy, _, _, _, turn = self._data.qvel[:6].tolist()
        time_s = round(self._substeps * TIMESTEP_S, 9)
        upright = 1.0 - 2.0 * (qx * qx + qy * qy)
        # Written so that a NaN fails it.
        if not (upright > _UPRIGHT and abs(x + y + z + vx + vy + turn) < 1e9):
            raise PhysicsError(
                f"the robot is not upright after {time_s:.1f} s in scene {self.scene.name}: "
                f"position ({x:.3f}, {y:.3f}, {z:.3f}) m, cosine of tilt {upright:.3f}. "
                "Remedy: reset it to a pose in free space; check its mass and sizes if changed"
            )
        yaw = math.atan2(2.0 * (qw * qz + qx * qy), 1.0 - 2.0 * (qy * qy + qz * qz))
        forward = math.cos(yaw) * vx + math.sin(yaw) * vy
        return SimState(Pose2(x, y, yaw), Velocity(forward, turn), contact, time_s)


def _approach(value: float, goal: float, most: float) -> float:
    """`value` moved towards `goal` by no more than `most`."""
    return min(goal, value + most) if goal > value else max(goal, value - most)
