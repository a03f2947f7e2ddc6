"""What the four functions of Neural Topological SLAM should answer, from the building alone.

The paper leaves these definitions to a supplement; docs/papers/nts.md gives ours with reasons.
Directions count from the source's heading, counter-clockwise, in 12 bins.
"""

import io
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float16, Float32, Float64, Int, Int32
from scipy import ndimage

from toponav.core.arrays import read_npz
from toponav.core.files import write_atomically
from toponav.core.geometry import Pose2
from toponav.core.imagenav import DIRECTIONS, NODE_RADIUS_M
from toponav.data.nts.ground import Ground
from toponav.data.nts.label_kernels import shortest_via
from toponav.data.nts.panoramas import HomePanoramas
from toponav.worlds.grid_kernels import geodesic_cells
from toponav.worlds.sight_kernels import cells_in_sight, pairs_in_sight

__all__ = [
    "EXPLORABLE_M2",
    "SCORE_LENGTH_M",
    "Exits",
    "HomeLabels",
    "direction_bins",
    "exits_of",
    "home_labels",
    "labels_of",
    "score_of",
]

EXPLORABLE_M2 = 1.0
"""Least floor, out of the node and in one piece, that makes a direction worth exploring."""

SCORE_LENGTH_M = 5.0
"""Way over which the score falls to 1/e: how much reaching the goal is worth after it."""

_VERSION = 1
"""Of the definitions: labels that were stored by another are made again."""


@dataclass(frozen=True, eq=False)
class Exits:
    """Where one leaves the node of a panorama.

    Attributes:
        node: The node: free cells in sight within its radius.
        cells: Row and column of the first cells outside it, of pieces worth exploring.
        bins: Direction of each, from the source's heading.
    """

    node: Bool[np.ndarray, "rows cols"]
    cells: Int32[np.ndarray, "exits 2"]
    bins: Int[np.ndarray, " exits"]


@dataclass(frozen=True, eq=False)
class HomeLabels:
    """The labels of all pairs of panoramas of one home: [source, goal].

    Attributes:
        same_node: Whether the goal is in sight of the source within the node's radius.
        bearing_rad: Direction of the goal from the source's heading, in [-pi, pi).
        distance_m: Straight distance between them.
        geodesic_m: Length of the shortest path between them.
        explorable: Whether there is something to explore in each direction from the source.
        via_m: Length of the shortest path to the goal that leaves the source's node in each
            direction; infinite where it is not explorable.
    """

    same_node: Bool[np.ndarray, "sources goals"]
    bearing_rad: Float32[np.ndarray, "sources goals"]
    distance_m: Float32[np.ndarray, "sources goals"]
    geodesic_m: Float32[np.ndarray, "sources goals"]
    explorable: Bool[np.ndarray, "sources directions"]
    via_m: Float16[np.ndarray, "sources goals directions"]

    def __len__(self) -> int:
        return len(self.same_node)


def score_of(via_m: np.ndarray) -> Float32[np.ndarray, "..."]:
    """How fast the goal is reached: 1 at once, 1/e after 5 m, 0 never.

    Example:
        >>> [round(score, 3) for score in score_of(np.array([0.0, 5.0, np.inf])).tolist()]
        [1.0, 0.368, 0.0]
    """
    return np.asarray(
        np.exp(-np.asarray(via_m, np.float32) / np.float32(SCORE_LENGTH_M)), np.float32
    )


def exits_of(ground: Ground, pose: Pose2, radius_m: float = NODE_RADIUS_M) -> Exits:
    """Where one leaves the node of a panorama, and in which direction from its heading.

    An exit is a free cell outside the node that touches it, in a piece of floor outside the
    node of at least `EXPLORABLE_M2`: a doorway, the rest of a long room, a corridor's corner,
    and not the shadow of a chair.
    """
    cell_m = ground.grid.resolution_m
    row, col = _in_cells(ground, np.array([[pose.x_m, pose.y_m]]))[0]
    node = ground.free & cells_in_sight(ground.opaque, row, col, radius_m / cell_m)
    own_row, own_col = ground.nearest_free(np.array([[int(row), int(col)]], np.int32))[0]
    node[own_row, own_col] = True
    outside = ground.free & ~node
    pieces, count = ndimage.label(outside)
    large = np.bincount(pieces.ravel(), minlength=count + 1) * cell_m**2 >= EXPLORABLE_M2
    large[0] = False
    cells = np.argwhere(ndimage.binary_dilation(node) & large[pieces]).astype(np.int32)
    center = cells + 0.5
    bearing_rad = np.arctan2(center[:, 0] - row, center[:, 1] - col) - pose.yaw_rad
    return Exits(node, cells, direction_bins(bearing_rad))


def home_labels(ground: Ground, poses: Float64[np.ndarray, "panoramas 3"]) -> HomeLabels:
    """The labels of all pairs of panoramas taken at these poses of one home."""
    count, cell_m = len(poses), ground.grid.resolution_m
    points = _in_cells(ground, poses[:, :2])
    own = ground.nearest_free(ground.cells_of(poses[:, :2]))
    unit = np.ones((1, 1), np.float32)
    # By cell, then by panorama: an exit's distances to all goals lie side by side.
    fields_m = np.empty((ground.free.size, count), np.float32)
    for number in range(count):
        field = geodesic_cells(ground.free, unit, 1.0, own[number : number + 1])
        fields_m[:, number] = field.ravel() * np.float32(cell_m)
    explorable = np.zeros((count, DIRECTIONS), bool)
    via_m = np.empty((count, count, DIRECTIONS), np.float16)
    for number in range(count):
        exits = exits_of(ground, Pose2(*poses[number].tolist()))
        at = exits.cells[:, 0] * ground.grid.cols + exits.cells[:, 1]
        to_cell_m = fields_m[at]
        via_m[number] = shortest_via(
            to_cell_m, np.ascontiguousarray(to_cell_m[:, number]), exits.bins, DIRECTIONS
        )
        explorable[number, exits.bins] = True
    offset = poses[None, :, :2] - poses[:, None, :2]
    bearing_rad = np.arctan2(offset[..., 1], offset[..., 0]) - poses[:, None, 2]
    return HomeLabels(
        same_node=pairs_in_sight(ground.opaque, points, NODE_RADIUS_M / cell_m),
        bearing_rad=((bearing_rad + np.pi) % (2 * np.pi) - np.pi).astype(np.float32),
        distance_m=np.hypot(offset[..., 0], offset[..., 1]).astype(np.float32),
        geodesic_m=fields_m[own[:, 0] * ground.grid.cols + own[:, 1]],
        explorable=explorable,
        via_m=via_m,
    )


def labels_of(home: HomePanoramas) -> HomeLabels:
    """The labels of a collected home; made on first use and kept beside its panoramas."""
    path = home.folder / f"labels-{_VERSION}-{len(home)}.npz"
    if not path.exists():
        labels = home_labels(home.ground, home.poses)
        content = io.BytesIO()
        np.savez_compressed(content, **vars(labels))
        write_atomically(path, content.getvalue())
        return labels
    n = len(home)
    wanted = {
        "same_node": ("bool", (n, n)),
        "bearing_rad": ("float32", (n, n)),
        "distance_m": ("float32", (n, n)),
        "geodesic_m": ("float32", (n, n)),
        "explorable": ("bool", (n, DIRECTIONS)),
        "via_m": ("float16", (n, n, DIRECTIONS)),
    }
    return HomeLabels(**read_npz(path, wanted, remedy="delete the file: it is made again"))


def _in_cells(ground: Ground, xy_m: np.ndarray) -> Float64[np.ndarray, "points 2"]:
    """Points as (row, col) in cells."""
    cells = (xy_m - np.asarray(ground.grid.origin_m)) / ground.grid.resolution_m
    return np.ascontiguousarray(cells[:, ::-1], np.float64)


def direction_bins(bearing_rad: np.ndarray) -> Int[np.ndarray, " bearings"]:
    """The direction bin of each bearing, as `bin_of_direction`."""
    bins = np.floor(bearing_rad * (DIRECTIONS / (2 * np.pi)) + 0.5)
    return np.asarray(bins, np.int64) % DIRECTIONS
