"""`toponav/BehavioralNav-v0`: a depth camera on a TurtleBot 2, driven at 5 Hz."""

from collections.abc import Sequence
from typing import Any, Literal, get_args

import gymnasium
import numpy as np
from jaxtyping import UInt8

from toponav.core.camera import Camera, PinholeCamera
from toponav.core.episode import Observation, Velocity, VelocityLimits
from toponav.core.errors import InputError, did_you_mean
from toponav.core.geometry import Pose2
from toponav.sim.registration import register
from toponav.sim.render.images import INSTANCE_OF_NOTHING
from toponav.sim.sensor_noise import DepthSensor, depth_sensor
from toponav.sim.simulation import CONTROL_PERIOD_S, SimState, Simulation
from toponav.worlds.free_space import FreeSpace
from toponav.worlds.scene import Scene

__all__ = ["BehavioralNavEnv", "Collisions"]

Collisions = Literal["fatal", "stuck"]

_REVERSE_M_S = 0.2
_START_GAP_M = 0.05


class BehavioralNavEnv(gymnasium.Env[dict[str, np.ndarray], np.ndarray]):
    """A building to drive in: depth images in, velocity commands out, 0.2 s a step.

    The action is (linear m/s, angular rad/s). The observation is `{"depth": float32}`, Z-depth
    in metres clipped at the camera's maximum; `modalities` adds `rgb` (uint8, three channels),
    `semantic` (uint8, a `SemanticClass` or 255) and `instance` (int32). `info` holds the truth
    after each step: `pose`, `velocity`, `contact` and `time_s`. The reward is always zero: what
    to reach is the task's to say.

    An episode terminates when the robot touches the building or anything in it, unless
    `collisions="stuck"`, and is truncated after `max_steps`.

    Args:
        scene: The building; by default the generated office of seed 0.
        camera: The camera: a `PinholeCamera` or a `PanoramaCamera`.
        limits: Speed and acceleration limits; they bound the action space.
        collisions: `fatal`: a contact ends the episode. `stuck`: the robot is merely blocked.
        max_steps: Steps after which an episode is truncated.
        backend: Which renderer to use, as in `make_renderer`.
        render_mode: `rgb_array` for the colour image from `render()`, or where that is no
            modality, the depth in colours.
        modalities: What an observation holds: any of `depth`, `rgb`, `semantic`, `instance`.
        sensor: A depth sensor, or its name (`kinect_v1`, `kinect_v2`, `realsense_d435`), whose
            errors depth has; holes read 0. The default is the truth.

    Example:
        >>> env = BehavioralNavEnv(scene)
        >>> observation, info = env.reset(seed=0, options={"pose": Pose2(1.0, 2.0, 0.0)})
        >>> observation, *_, info = env.step(np.array([0.5, 0.0], np.float32))
    """

    metadata: dict[str, Any] = {  # noqa: RUF012 - as Gymnasium declares it
        "render_modes": ["rgb_array"],
        "render_fps": round(1 / CONTROL_PERIOD_S),
    }

    def __init__(
        self,
        scene: Scene | None = None,
        camera: Camera = PinholeCamera(),  # noqa: B008 - frozen
        limits: VelocityLimits = VelocityLimits(),  # noqa: B008 - frozen
        collisions: str = "fatal",
        max_steps: int = 3000,
        backend: str = "auto",
        render_mode: str | None = None,
        modalities: Sequence[str] = ("depth",),
        sensor: DepthSensor | str | None = None,
    ) -> None:
        _check_choice("collisions", collisions, get_args(Collisions))
        if render_mode is not None:
            _check_choice("render_mode", render_mode, self.metadata["render_modes"])
        if max_steps < 1:
            raise InputError(
                f"max_steps must be at least 1, got {max_steps}",
                where="BehavioralNavEnv",
                remedy="3000 steps are ten minutes",
            )
        self.scene = scene if scene is not None else _default_scene()
        self.simulation = Simulation(
            self.scene,
            camera,
            limits,
            backend,
            modalities=modalities,
            sensor=depth_sensor(sensor) if isinstance(sensor, str) else sensor,
        )
        self.camera = camera
        self.collisions = collisions
        self.max_steps = max_steps
        self.render_mode = render_mode
        self.action_space = gymnasium.spaces.Box(
            np.array([-_REVERSE_M_S, -limits.angular_rad_s], np.float32),
            np.array([limits.linear_m_s, limits.angular_rad_s], np.float32),
        )
        spaces = _image_spaces(camera)
        self.observation_space = gymnasium.spaces.Dict(  # type: ignore[assignment]
            {name: spaces[name] for name in modalities}
        )
        self._steps = 0
        self._start_cells: np.ndarray | None = None
        self._observation: Observation | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """The first observation, at `options["pose"]` or at a random free pose.

        Args:
            seed: Seed of the random pose; the same seed gives the same pose.
            options: `{"pose": Pose2}` or nothing.

        Raises:
            InputError: If an option is unknown or the pose is not inside the building.
        """
        super().reset(seed=seed)
        options = options or {}
        for name in options:
            _check_choice("option", name, ["pose"])
        pose = Pose2(*options["pose"]) if "pose" in options else self._random_pose()
        # Only where a sensor errs, so that seeds without one keep their poses.
        if self.simulation.sensor is not None:
            self.simulation.sensor_seed = int(self.np_random.integers(2**31))
        state = self.simulation.reset(pose)
        self._steps = 0
        return self._observe(), _info(state)

    def step(
        self, action: np.ndarray
    ) -> tuple[dict[str, np.ndarray], float, bool, bool, dict[str, Any]]:
        """What the robot senses after following a command for one control period.

        Raises:
            InputError: If the action is not two finite numbers, or nothing was reset yet.
        """
        command = np.asarray(action, np.float64)
        if command.shape != (2,) or not np.isfinite(command).all():
            raise InputError(
                f"an action is two finite numbers (m/s, rad/s), got {command.tolist()}",
                where=f"step {self._steps}",
                remedy="stop the robot, (0, 0), when its command cannot be computed",
            )
        state = self.simulation.step(Velocity(float(command[0]), float(command[1])))
        self._steps += 1
        terminated = state.contact is not None and self.collisions == "fatal"
        return self._observe(), 0.0, terminated, self._steps >= self.max_steps, _info(state)

    def render(self) -> UInt8[np.ndarray, "height width 3"] | None:
        """The colour image, or the depth in colours from near red to far blue."""
        if self.render_mode is None or self._observation is None:
            return None
        if self._observation.rgb is not None:
            return self._observation.rgb.copy()
        from matplotlib import colormaps

        nearness = 1.0 - self._observation.depth_m / self.camera.max_depth_m
        colors: UInt8[np.ndarray, "height width 4"] = colormaps["turbo"](nearness, bytes=True)
        return np.ascontiguousarray(colors[..., :3])

    def _observe(self) -> dict[str, np.ndarray]:
        self._observation = self.simulation.observe()
        images = {
            "depth": self._observation.depth_m,
            "rgb": self._observation.rgb,
            "semantic": self._observation.semantic,
            "instance": self._observation.instance,
        }
        return {name: images[name] for name in self.simulation.modalities}  # type: ignore[misc]

    def _random_pose(self) -> Pose2:
        if self._start_cells is None:
            space = FreeSpace.of(self.scene, self.simulation.robot.radius_m + _START_GAP_M)
            self._start_cells = np.argwhere(space.component == 1)
        if len(self._start_cells) == 0:
            raise InputError(
                "the robot fits nowhere in this building",
                where=f"scene {self.scene.name}",
                remedy="pass options={'pose': ...}, or use another scene",
            )
        row, col = self._start_cells[self.np_random.integers(len(self._start_cells))]
        yaw_rad = float(self.np_random.uniform(-np.pi, np.pi))
        return Pose2(*self.scene.grid.center_of(int(row), int(col)), yaw_rad)


def _image_spaces(camera: Camera) -> dict[str, gymnasium.spaces.Box]:
    """The space of each modality's images."""
    shape = (camera.height, camera.width)
    return {
        "depth": gymnasium.spaces.Box(0.0, camera.max_depth_m, shape, np.float32),
        "rgb": gymnasium.spaces.Box(0, 255, (*shape, 3), np.uint8),
        "semantic": gymnasium.spaces.Box(0, 255, shape, np.uint8),
        "instance": gymnasium.spaces.Box(
            INSTANCE_OF_NOTHING, np.iinfo(np.int32).max, shape, np.int32
        ),
    }


def _info(state: SimState) -> dict[str, Any]:
    return dict(state._asdict())


def _check_choice(what: str, value: str, valid: list[str] | tuple[str, ...]) -> None:
    if value not in valid:
        raise InputError(
            f"no {what} is called '{value}'",
            where="BehavioralNavEnv",
            remedy=did_you_mean(str(value), valid),
        )


def _default_scene() -> Scene:
    from toponav.worlds.generate.office import generate_office

    return generate_office(0)


# What `gymnasium.make("toponav.sim.env:...")` imports this module for.
register()
