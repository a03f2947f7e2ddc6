"""Sampling episodes of image-goal navigation, and measuring how hard they are."""

import math
from collections.abc import Callable, Sequence

import numpy as np

from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.core.imagenav import (
    DIFFICULTIES,
    DIFFICULTY_M,
    IMAGE_NAV_ROBOT_RADIUS_M,
    NODE_RADIUS_M,
    ImageNavEpisode,
)
from toponav.data.nts.ground import CAMERA_HEIGHT_M
from toponav.worlds.free_space import FreeSpace
from toponav.worlds.generate.suites import suite, suite_scene
from toponav.worlds.scene import Scene
from toponav.worlds.shortest_path import any_angle_length_m
from toponav.worlds.sight_kernels import is_clear

__all__ = ["episode_statistics", "sample_episodes", "sample_route"]

_TRIES = 2000


def sample_episodes(
    suite_name: str,
    count: int,
    seed: int = 0,
    on_progress: Callable[[int], None] | None = None,
) -> list[ImageNavEpisode]:
    """Random episodes, so many of each difficulty, over all buildings of a suite in turn.

    The goal is anywhere; the start anywhere at the difficulty's distance along the shortest
    path. Nothing else is asked of them: no straight or easy one is added or left out. Episode k
    of a building and difficulty is a pure function of the seed.

    Args:
        suite_name: Suite of homes.
        count: Episodes of each difficulty.
        seed: Seed of the episodes.
        on_progress: Told how many buildings are done.
    """
    chosen = suite(suite_name)
    numbers = {
        scene_seed: range(first, count, len(chosen.seeds))
        for first, scene_seed in enumerate(chosen.seeds)
    }
    episodes = []
    for done, (scene_seed, wanted) in enumerate(numbers.items()):
        space = FreeSpace.of(suite_scene(chosen.generator, scene_seed), IMAGE_NAV_ROBOT_RADIUS_M)
        for difficulty in DIFFICULTIES:
            for number in wanted:
                key = [seed, DIFFICULTIES.index(difficulty), scene_seed, number]
                rng = np.random.default_rng(key)
                start, goal, length_m = sample_route(space, *DIFFICULTY_M[difficulty], rng)
                episodes.append(
                    ImageNavEpisode(
                        suite_name, scene_seed, start, goal, length_m, difficulty, number
                    )
                )
        if on_progress is not None:
            on_progress(done + 1)
    return sorted(episodes, key=lambda one: (DIFFICULTIES.index(one.difficulty), one.number))


def sample_route(
    space: FreeSpace, near_m: float, far_m: float, rng: np.random.Generator
) -> tuple[Pose2, Pose2, float]:
    """A start, a goal and the length of the shortest path between them.

    Args:
        space: Where the robot can be.
        near_m: The shortest path is at least so long.
        far_m: And shorter than this.
        rng: Draws them.

    Raises:
        InputError: If no two places are so far apart.
    """
    cells = np.argwhere(space.component == 1)
    for _ in range(_TRIES if len(cells) else 0):
        goal = _pose_in(space, cells[rng.integers(len(cells))], rng)
        field_m = space.geodesic_m((goal.x_m, goal.y_m))
        distance_m = field_m[cells[:, 0], cells[:, 1]]
        # Eight neighbours overestimate by up to 8.3 %: the exact length decides below.
        fitting = cells[(distance_m >= near_m) & (distance_m < far_m * 1.083)]
        if not len(fitting):
            continue
        start = _pose_in(space, fitting[rng.integers(len(fitting))], rng)
        length_m = any_angle_length_m(space, field_m, (start.x_m, start.y_m), (goal.x_m, goal.y_m))
        length_m = round(length_m, 4)
        if near_m <= length_m < far_m:
            return start, goal, length_m
    raise InputError(
        f"no two places are {near_m:g} to {far_m:g} m apart",
        where="episodes",
        remedy="use larger buildings",
    )


def _pose_in(space: FreeSpace, cell: np.ndarray, rng: np.random.Generator) -> Pose2:
    x_m, y_m = space.grid.center_of(*cell.tolist())
    return Pose2(round(x_m, 4), round(y_m, 4), round(float(rng.uniform(-math.pi, math.pi)), 4))


def episode_statistics(
    episodes: Sequence[ImageNavEpisode], scene_of: Callable[[int], Scene]
) -> dict[str, dict[str, int | float]]:
    """How long and how hidden the ways are, by difficulty.

    Args:
        episodes: Of one suite.
        scene_of: The building of a seed.

    Returns:
        By difficulty: the number of episodes, mean path length, mean ratio of path to straight
        line, fractions whose goal lies in the same room or the same node as the start, and the
        mean number of rooms that the path crosses.
    """
    rows: dict[str, list[tuple[float, float, bool, bool, int]]] = {}
    for scene_seed in sorted({one.scene_seed for one in episodes}):
        scene = scene_of(scene_seed)
        space = FreeSpace.of(scene, IMAGE_NAV_ROBOT_RADIUS_M)
        opaque = scene.heights_m > CAMERA_HEIGHT_M
        for one in episodes:
            if one.scene_seed != scene_seed:
                continue
            field_m = space.geodesic_m((one.goal.x_m, one.goal.y_m))
            path = space.path_m(field_m, (one.start.x_m, one.start.y_m))
            cells = [scene.grid.cell_of(*point) for point in path.tolist()]
            rooms = [int(scene.room_index[cell]) for cell in cells]
            straight_m = one.start.distance_to(one.goal)
            ends = [
                (np.array([y, x]) - np.array(scene.grid.origin_m[::-1])) / scene.grid.resolution_m
                for x, y in (one.start[:2], one.goal[:2])
            ]
            in_node = straight_m <= NODE_RADIUS_M and bool(is_clear(opaque, *ends[0], *ends[1]))
            row = (
                one.geodesic_m,
                one.geodesic_m / straight_m,
                rooms[0] == rooms[-1],
                in_node,
                len({room for room in rooms if room >= 0}),
            )
            rows.setdefault(one.difficulty, []).append(row)
    names = ("path_m", "path_over_straight", "same_room", "same_node", "rooms")
    return {
        difficulty: {
            "episodes": len(rows[difficulty]),
            **{
                name: round(float(value), 4)
                for name, value in zip(names, np.mean(rows[difficulty], axis=0), strict=True)
            },
        }
        for difficulty in DIFFICULTIES
        if difficulty in rows
    }
