"""Which episodes an evaluation runs: the first of each difficulty, spread over the buildings."""

import math
from collections.abc import Sequence

import numpy as np

from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.core.imagenav import (
    DIFFICULTY_M,
    IMAGE_NAV_ROBOT_RADIUS_M,
    Difficulty,
    ImageNavEpisode,
)
from toponav.evaluation.suite import seed_of
from toponav.worlds.free_space import FreeSpace
from toponav.worlds.generate.suites import suite, suite_scene
from toponav.worlds.shortest_path import any_angle_length_m

__all__ = ["load_episode_set"]


def load_episode_set(
    suite_name: str, levels: Sequence[Difficulty], count: int
) -> tuple[ImageNavEpisode, ...]:
    """The first `count` episodes of each difficulty."""
    seeds = suite(suite_name).seeds
    episodes = []
    spaces: dict[int, FreeSpace] = {}
    for level in levels:
        for number in range(count):
            seed = seeds[number % len(seeds)]
            if seed not in spaces:
                spaces[seed] = FreeSpace.of(
                    suite_scene(suite(suite_name).generator, seed), IMAGE_NAV_ROBOT_RADIUS_M
                )
            episodes.append(_sampled(spaces[seed], suite_name, seed, level, number))
    return tuple(episodes)


def _sampled(
    space: FreeSpace, suite_name: str, seed: int, level: Difficulty, number: int
) -> ImageNavEpisode:
    rng = np.random.default_rng(seed_of(suite_name, level, number))
    near_m, far_m = DIFFICULTY_M[level]
    cells = np.argwhere(space.component == 1)
    for _ in range(1000):
        ends = [
            Pose2(
                *space.grid.center_of(*cells[rng.integers(len(cells))].tolist()),
                rng.uniform(-math.pi, math.pi),
            )
            for _ in range(2)
        ]
        goal_xy = (ends[1].x_m, ends[1].y_m)
        field_m = space.geodesic_m(goal_xy)
        length_m = any_angle_length_m(space, field_m, (ends[0].x_m, ends[0].y_m), goal_xy)
        if near_m <= length_m < far_m:
            return ImageNavEpisode(suite_name, seed, ends[0], ends[1], length_m, level, number)
    raise InputError(
        "no episode was found", where=f"{suite_name}/{level}/{number}", remedy="use another level"
    )
