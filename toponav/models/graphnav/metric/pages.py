"""The maps and plans of many robots, drawn around their believed poses at once."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from jaxtyping import Bool, Float32, Float64, Int64

from toponav.core.vocabulary import Behavior
from toponav.models.graphnav.metric.batch_kernels import Pages, draw_pages
from toponav.models.graphnav.metric.map_picture import (
    AHEAD_M,
    MAP_CHANNELS,
    PLAN_FEATURES,
    MapArrays,
)

__all__ = ["Drawn", "Pages", "draw_beliefs", "pages_of"]

_AHEAD: Final = np.array(AHEAD_M)


@dataclass(frozen=True)
class Drawn:
    """What the map and the plan look like from believed poses.

    Attributes:
        pictures: `[batch, channels, forward, left]`.
        features: `[batch, PLAN_FEATURES]`.
        progress_m: Metres of the plan behind each believed pose.
    """

    pictures: Float32[np.ndarray, "batch channels forward left"]
    features: Float32[np.ndarray, "batch features"]
    progress_m: Float64[np.ndarray, " batch"]


def draw_beliefs(
    pages: Pages,
    page: Int64[np.ndarray, " batch"],
    believed: Float64[np.ndarray, "batch 3"],
    bounds_m: Float64[np.ndarray, "batch 2"],
    cell_m: float,
    cells: int,
    *,
    noise_m: Float64[np.ndarray, "batch nodes 2"] | None = None,
    mirrored: Bool[np.ndarray, " batch"] | None = None,
) -> Drawn:
    """Draw each believed pose on its page.

    Args:
        pages: Maps and plans.
        page: Which one each pose is on.
        believed: x, y, yaw in the map's frame.
        bounds_m: Metres of the plan between which its progress is sought.
        cell_m: Side of a pixel.
        cells: Pixels along a side.
        noise_m: Moves the nodes.
        mirrored: Which of them to mirror left to right.
    """
    count = len(page)
    drawn = Drawn(
        np.empty((count, MAP_CHANNELS, cells, cells), np.float32),
        np.empty((count, PLAN_FEATURES), np.float32),
        np.empty(count),
    )
    draw_pages(
        pages,
        page,
        believed,
        np.ascontiguousarray(bounds_m[:, 0]),
        np.ascontiguousarray(bounds_m[:, 1]),
        np.empty((count, 0, 2)) if noise_m is None else noise_m,
        cell_m,
        _AHEAD,
        len(Behavior),
        np.zeros(count, bool) if mirrored is None else mirrored,
        drawn.pictures,
        drawn.features,
        drawn.progress_m,
    )
    return drawn


def pages_of(arrays: Sequence[MapArrays]) -> Pages:
    """The maps and plans end to end."""

    def starts(counts: list[int]) -> Int64[np.ndarray, " bounds"]:
        return np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)

    return Pages(
        starts([len(one.node_xy) for one in arrays]),
        np.concatenate([one.node_xy for one in arrays]),
        np.concatenate([one.node_kind for one in arrays]),
        np.concatenate([one.on_plan for one in arrays]),
        starts([len(one.edges) for one in arrays]),
        np.concatenate([one.edges for one in arrays]),
        starts([len(one.kept.share) for one in arrays]),
        np.concatenate([one.kept.ends for one in arrays]),
        np.concatenate([one.kept.share for one in arrays]),
        np.concatenate([one.kept.shift_m for one in arrays]),
        np.concatenate([one.behaviors for one in arrays]),
    )
