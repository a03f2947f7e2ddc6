"""Pictures and numbers for many believed poses at once, compiled."""

from typing import NamedTuple

import numpy as np
from numba import njit

from toponav.models.graphnav.metric.map_picture_kernels import (
    arc_lengths,
    draw_map,
    path_features,
    progress_on,
    way_points,
)

__all__ = ["Pages", "draw_pages"]


class Pages(NamedTuple):
    """The maps and plans of many trajectories, end to end.

    Page i owns nodes `node_at[i]:node_at[i + 1]`, and likewise edges and points of its path;
    edges and the ends of a path's points (`KeptWay`) index the page's own nodes.
    """

    node_at: np.ndarray
    node_xy: np.ndarray
    node_kind: np.ndarray
    on_plan: np.ndarray
    edge_at: np.ndarray
    edges: np.ndarray
    path_at: np.ndarray
    path_ends: np.ndarray
    path_share: np.ndarray
    path_shift_m: np.ndarray
    behaviors: np.ndarray


@njit(cache=True)
def draw_pages(
    pages: Pages,
    page: np.ndarray,
    believed: np.ndarray,
    low_m: np.ndarray,
    high_m: np.ndarray,
    noise: np.ndarray,
    cell_m: float,
    ahead_m: np.ndarray,
    kinds: int,
    mirrored: np.ndarray,
    pictures: np.ndarray,
    features: np.ndarray,
    progress_m: np.ndarray,
) -> None:
    """Draw each believed pose [batch, 3] on its page, and say what the plan looks like.

    Progress is sought between `low_m` and `high_m` and left in `progress_m`. `noise` [batch,
    nodes, 2] moves the nodes; with none along its second axis they stay.
    """
    for b in range(believed.shape[0]):
        p = page[b]
        n0, n1 = pages.node_at[p], pages.node_at[p + 1]
        e0, e1 = pages.edge_at[p], pages.edge_at[p + 1]
        s0, s1 = pages.path_at[p], pages.path_at[p + 1]
        node_xy = pages.node_xy[n0:n1].copy()
        if noise.shape[1]:
            node_xy += noise[b, : n1 - n0]
        path = way_points(
            node_xy, pages.path_ends[s0:s1], pages.path_share[s0:s1], pages.path_shift_m[s0:s1]
        )
        arc = arc_lengths(path)
        at = progress_on(path, arc, believed[b, 0], believed[b, 1], low_m[b], high_m[b])
        progress_m[b] = at
        draw_map(
            node_xy,
            pages.node_kind[n0:n1],
            pages.on_plan[n0:n1],
            pages.edges[e0:e1],
            path,
            arc,
            at,
            believed[b],
            cell_m,
            pictures[b],
        )
        features[b] = 0.0
        behaviors = pages.behaviors[s0:s1]
        path_features(path, arc, behaviors, at, believed[b], ahead_m, kinds, features[b])
        if mirrored[b]:
            pictures[b] = pictures[b, :, :, ::-1].copy()
            for k in range(ahead_m.shape[0]):
                features[b, 2 * k + 1] = -features[b, 2 * k + 1]
            at = 2 * ahead_m.shape[0] + 1
            for _ in range(3):
                # Left and right turns change places: 2 and 3 in `Behavior`.
                left = features[b, at + 2]
                features[b, at + 2] = features[b, at + 3]
                features[b, at + 3] = left
                at += kinds
