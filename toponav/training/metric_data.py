"""A training set with what preset `best` derives from it: local maps, odometry, beliefs."""

import functools
import hashlib
from pathlib import Path
from typing import Final, Literal

import numpy as np
from jaxtyping import Float32, Float64, Int64, UInt8

from toponav.core.files import write_atomically
from toponav.data.training_set import TrainingSet
from toponav.models.graphnav.metric import local_map_kernels as kernels
from toponav.models.graphnav.metric.batch_kernels import Pages
from toponav.models.graphnav.metric.local_map import LocalMapConfig
from toponav.models.graphnav.metric.map_picture import MapArrays
from toponav.models.graphnav.metric.map_picture_kernels import follow_progress
from toponav.models.graphnav.metric.odometry import CommandOdometry, motion_steps
from toponav.models.graphnav.metric.pages import pages_of
from toponav.models.graphnav.metric.profile import bin_azimuths_rad
from toponav.models.graphnav.presets import ImageSpec
from toponav.training.samples import first_frames

__all__ = ["MetricData"]

_MOST_BYTES_IN_MEMORY: Final = 4 << 30


class MetricData:
    """Frames with the local map that the robot would have had at each of them.

    The local maps are made once and kept in files beside the cache of profiles.

    Args:
        directory: Cache written by `prepare` for preset `best`.
        config: Sizes of the local maps.
        odometry: The robot's response to commands.
    """

    def __init__(
        self,
        directory: str | Path,
        config: LocalMapConfig,
        odometry: CommandOdometry | None = None,
    ) -> None:
        self.data = TrainingSet.open(directory)
        self.config = config
        self.first: Int64[np.ndarray, " frames"] = first_frames(self.data.trajectory)
        is_first = self.first == np.arange(len(self.first))
        self.steps: Float64[np.ndarray, "frames 3"] = motion_steps(
            self.data.executed, is_first, odometry
        )
        self.near, self.far = self._views(Path(directory), is_first)
        self.progress_m = np.zeros(len(self.first), np.float32)
        self._maps: dict[int, MapArrays] = {}

    def __len__(self) -> int:
        return len(self.first)

    def arrays_of(self, trajectory: int) -> MapArrays:
        """Map and plan of a trajectory."""
        if trajectory not in self._maps:
            self._maps[trajectory] = MapArrays.of(
                self.data.map_of(trajectory), self.data.plan_of(trajectory)
            )
        return self._maps[trajectory]

    def start_pose(self, trajectory: int) -> Float64[np.ndarray, " 3"]:
        """What a robot is told at a trajectory's start: the plan's first node, along its edge."""
        topological_map = self.data.map_of(trajectory)
        plan = self.data.plan_of(trajectory)
        node = topological_map.node(plan.nodes[0])
        return np.array([node.x_m, node.y_m, topological_map.edge(plan.edges[0]).yaw_rad])

    def _views(
        self, directory: Path, is_first: np.ndarray
    ) -> tuple[UInt8[np.ndarray, "frames cells cells"], UInt8[np.ndarray, "frames cells cells"]]:
        """The near and the far views, made where they are not there yet."""
        config, cells = self.config, self.config.view_cells
        text = repr((config, self.data.image, len(is_first)))
        key = hashlib.sha256(text.encode() + self.steps.tobytes()).hexdigest()[:16]
        paths = [directory / f"local_maps_{name}.npy" for name in ("near", "far")]
        shape = (len(is_first), cells, cells)
        stamp = directory / "local_maps.key"
        if not (stamp.exists() and stamp.read_text() == key):
            made = [np.lib.format.open_memmap(path, "w+", np.uint8, shape) for path in paths]
            kernels.replay(
                np.asarray(self.data.frames),
                self.steps,
                is_first,
                config.cell_m,
                config.cells,
                bin_azimuths_rad(ImageSpec(**self.data.image)).astype(np.float64),
                float(self.data.image["max_depth_m"]),
                config.reach_m,
                np.array([config.near_cell_m, config.far_cell_m]),
                *(np.asarray(views) for views in made),
            )
            for views in made:
                views.flush()
            write_atomically(stamp, key.encode())
        # Random rows of a mapped file wait for the disk; what fits is read at once.
        mode: Literal["r"] | None = "r" if np.prod(shape) > _MOST_BYTES_IN_MEMORY else None
        near, far = (np.asarray(np.load(path, mmap_mode=mode)) for path in paths)
        return near, far

    @functools.cached_property
    def pages(self) -> Pages:
        """The maps and plans of all trajectories, as the kernels want them."""
        return pages_of([self.arrays_of(number) for number in range(self.data.trajectories)])

    def true_progress(self) -> Float32[np.ndarray, " frames"]:
        """Metres of the plan behind the true pose, followed along each trajectory."""
        if not self.progress_m.any():
            for trajectory in range(self.data.trajectories):
                rows = self.data.rows_of(trajectory)
                points, arc = self.arrays_of(trajectory).way()
                self.progress_m[rows] = follow_progress(points, arc, self.data.pose[rows])
        return self.progress_m
