"""What the learned baselines are told in a step: the same in training and on the robot."""

import math
from functools import cached_property

import numpy as np
from jaxtyping import Float64, Int64, UInt8

from toponav.core.camera import CYLINDER_LIFT
from toponav.core.geometry import Pose2
from toponav.core.imagenav import Action, ImageGoal, PanoramaObservation
from toponav.models.baselines.image_goal_presets import (
    MAP_CELLS,
    MAP_CHANNELS,
    SENSORS,
    ImageGoalConfig,
)
from toponav.models.nts.panorama import (
    CAMERA_HEIGHT_M,
    DEPTH_SCALE_M,
    OBSTACLE_HEIGHTS_M,
    network_input,
)
from toponav.models.nts.presets import NTSConfig
from toponav.navigation.baselines.egocentric_map_kernels import add_cylinder, cut_around

__all__ = ["EgocentricMap", "Senses", "picture_of"]

_MAP_ROWS, _MAP_COLS = 32, 144
_GRID_SIDE_M, _GRID_CELL_M = 32.0, 0.1
_NEAR_CELL_M, _FAR_CELL_M = 0.2, 0.6
_FARTHEST_M = 6.0


def picture_of(
    rgb: UInt8[np.ndarray, "height width 3"],
    depth_m: np.ndarray | None,
    config: NTSConfig,
    *,
    is_cylinder: bool = True,
) -> UInt8[np.ndarray, "channels rows cols"]:
    """A panorama as the network sees it.

    A stitched panorama is laid on a cylinder and made small; one of a cylindrical camera of the
    network's own size, as training renders it, is taken as it is.

    Args:
        rgb: The panorama.
        depth_m: Its depth, asked for where the network sees depth.
        config: Sizes.
        is_cylinder: Whether the network sees cylinders; else panoramas as the camera gives them.
    """
    if is_cylinder and rgb.shape[:2] != (config.rows, config.cols):
        return network_input(rgb, depth_m, config)
    picture = np.empty((config.channels, *rgb.shape[:2]), np.uint8)
    picture[:3] = np.moveaxis(rgb, -1, 0)
    if config.depth:
        assert depth_m is not None
        picture[3] = np.rint(255.0 * np.exp(-depth_m / DEPTH_SCALE_M))
    if not is_cylinder:
        return picture
    return np.ascontiguousarray(picture[:, :, _from_forward(config.cols)])


def _from_forward(cols: int) -> Int64[np.ndarray, " cols"]:
    """Columns of a camera's panorama in the network's order: from forward to the left."""
    return np.asarray((cols // 2 + 1 - np.arange(cols)) % cols)


class EgocentricMap:
    """Obstacles and free floor around the robot, projected from depth along the odometry.

    Two maps with the robot in the middle, facing the last column: 6.4 m wide and 19.2 m wide.

    Reference:
        Chen, Gupta, Gupta 2019, Learning exploration policies for navigation, section 3.
    """

    def __init__(self) -> None:
        cells = round(_GRID_SIDE_M / _GRID_CELL_M)
        self._grid = np.zeros((cells, cells), np.uint8)

    def reset(self) -> None:
        """Forgets everything."""
        self._grid[:] = 0

    def add(self, depth: UInt8[np.ndarray, "rows cols"], pose: Pose2) -> None:
        """Adds the depth of a picture on a cylinder, as `picture_of` makes it, taken at a pose."""
        range_m = _RANGE_M[depth]
        add_cylinder(
            self._grid,
            _GRID_CELL_M,
            np.array(pose, np.float64),
            range_m,
            self._yaw(depth.shape[1]),
            CYLINDER_LIFT * (1.0 - (np.arange(depth.shape[0]) + 0.5) * 2 / depth.shape[0]),
            CAMERA_HEIGHT_M,
            *OBSTACLE_HEIGHTS_M,
            _FARTHEST_M,
        )

    def around(self, pose: Pose2) -> UInt8[np.ndarray, "channels cells cells"]:
        """Obstacles and free floor near, then far, as the robot at a pose has them around it."""
        out = np.empty((MAP_CHANNELS, MAP_CELLS, MAP_CELLS), np.uint8)
        here = np.array(pose, np.float64)
        cut_around(self._grid, _GRID_CELL_M, here, _NEAR_CELL_M, out[:2])
        cut_around(self._grid, _GRID_CELL_M, here, _FAR_CELL_M, out[2:])
        return out

    @staticmethod
    def _yaw(cols: int) -> Float64[np.ndarray, " cols"]:
        step = 2 * math.pi / cols
        return -2.0 * step + (np.arange(cols) + 0.5) * step


class Senses:
    """Turns observations into the inputs of a network, step by step.

    Args:
        config: The network's.
    """

    def __init__(self, config: ImageGoalConfig) -> None:
        self.config = config
        self._map = EgocentricMap() if config.metric_map else None
        self._goal: np.ndarray | None = None

    def reset(self, goal: ImageGoal) -> UInt8[np.ndarray, "channels rows cols"]:
        """Begins an episode; the goal as the network sees it."""
        if self._map is not None:
            self._map.reset()
        self._goal = self._picture(goal.rgb, goal.depth_m)
        return self._goal

    def observe(
        self, observation: PanoramaObservation, last: Action | None
    ) -> dict[str, np.ndarray]:
        """The inputs after one step: `image`, `goal`, `sensors`, and `map` where it is used.

        Args:
            observation: What the robot senses.
            last: What it did before; None at the start.
        """
        assert self._goal is not None, "reset comes first"
        sensors = np.zeros(SENSORS, np.float32)
        if last is not None:
            sensors[int(last)] = 1.0
        sensors[-1] = float(bool(observation.collided))
        image = self._picture(observation.rgb, observation.depth_m)
        inputs = {"image": image, "goal": self._goal, "sensors": sensors}
        if self._map is not None:
            assert observation.depth_m is not None
            self._map.add(self._map_depth(observation, image), observation.odometry)
            inputs["map"] = self._map.around(observation.odometry)
        return inputs

    def _picture(self, rgb: np.ndarray, depth_m: np.ndarray | None) -> np.ndarray:
        return picture_of(rgb, depth_m, self._vision, is_cylinder=self.config.is_cylinder)

    def _map_depth(self, observation: PanoramaObservation, image: np.ndarray) -> np.ndarray:
        """The depth that the map is made from: always a small cylinder."""
        if self.config.is_cylinder:
            depth: np.ndarray = image[3]
            return depth
        small = NTSConfig(rows=_MAP_ROWS, cols=_MAP_COLS, depth=True)
        return np.asarray(picture_of(observation.rgb, observation.depth_m, small)[3])

    @cached_property
    def _vision(self) -> NTSConfig:
        return self.config.vision


_RANGE_M = (-DEPTH_SCALE_M * np.log(np.maximum(np.arange(256), 0.5) / 255.0)).astype(np.float32)
