"""Why searches fail, told from their records and the building."""

from collections import Counter
from collections.abc import Iterable
from functools import lru_cache
from typing import Literal, get_args

import numpy as np

from toponav.core.geometry import Pose2
from toponav.core.imagenav import NODE_RADIUS_M, SUCCESS_RADIUS_M
from toponav.data.nts.ground import Ground
from toponav.evaluation.imagenav.episode import ImageNavRecord
from toponav.worlds.generate.suites import suite, suite_scene
from toponav.worlds.sight_kernels import is_clear

__all__ = ["FAILURES", "Failure", "count_failures", "failure_of", "in_one_node"]

Failure = Literal["stuck", "never_in_sight", "not_recognized", "wrong_place", "beside_the_goal"]
FAILURES: tuple[Failure, ...] = get_args(Failure)
"""How a search can fail: `stuck` where the robot got no further in the last 150 steps,
`never_in_sight` of the goal's node, in it without stopping, stopped elsewhere, and stopped
within twice the radius of success."""

_STUCK_STEPS, _STUCK_M = 150, 0.75


def in_one_node(ground: Ground, here: Pose2, there: Pose2) -> bool:
    """Whether one place is in sight of the other within the node's radius (what F_L learns)."""
    if here.distance_to(there) > NODE_RADIUS_M:
        return False
    ends = [_in_cells(ground, pose) for pose in (here, there)]
    return bool(is_clear(ground.opaque, *ends[0], *ends[1]))


def failure_of(record: ImageNavRecord, ground: Ground, goal: int = 0) -> Failure | None:
    """Why one search failed; None where it did not.

    Args:
        record: The episode.
        ground: Of its building.
        goal: Number of the goal.
    """
    found = record.goals[goal]
    if found.success:
        return None
    if found.outcome == "wrong_stop":
        is_near = found.distance_m <= 2.0 * SUCCESS_RADIUS_M
        return "beside_the_goal" if is_near else "wrong_place"
    steps = [step for step in record.steps if step.goal == goal]
    last = np.array([[step.x_m, step.y_m] for step in steps[-_STUCK_STEPS:]])
    if len(last) == _STUCK_STEPS and float(np.ptp(last, axis=0).max()) < _STUCK_M:
        return "stuck"
    poses = (Pose2(step.x_m, step.y_m, step.yaw_rad) for step in steps)
    if any(in_one_node(ground, pose, found.goal) for pose in poses):
        return "not_recognized"
    return "never_in_sight"


def count_failures(records: Iterable[ImageNavRecord]) -> dict[str, dict[str, int]]:
    """How often each agent failed in which way, by difficulty; the first goal counts."""
    counts: dict[str, Counter[str]] = {}
    for record in sorted(records, key=lambda one: one.episode.scene_seed):
        episode = record.episode
        ground = _ground(episode.scene_suite, episode.scene_seed)
        found = failure_of(record, ground)
        level = counts.setdefault(record.agent, Counter())
        level[f"{episode.difficulty}/{found or 'success'}"] += 1
    return {agent: dict(sorted(found.items())) for agent, found in counts.items()}


@lru_cache(maxsize=1)
def _ground(suite_name: str, seed: int) -> Ground:
    return Ground.of(suite_scene(suite(suite_name).generator, seed))


def _in_cells(ground: Ground, pose: Pose2) -> tuple[float, float]:
    x0_m, y0_m = ground.grid.origin_m
    cell_m = ground.grid.resolution_m
    return (pose.y_m - y0_m) / cell_m, (pose.x_m - x0_m) / cell_m
