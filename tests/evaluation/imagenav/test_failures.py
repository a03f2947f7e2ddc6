"""Why a search failed, told from where the robot went."""

from dataclasses import replace

import pytest

from tests.evaluation.imagenav.searches import building, record
from toponav.core.geometry import Pose2
from toponav.data.nts.ground import Ground
from toponav.evaluation.imagenav.episode import ImageNavRecord, ImageNavStep
from toponav.evaluation.imagenav.failures import failure_of, in_one_node


def _drive(outcome: str, xs: list[float], left_m: float = 5.0) -> ImageNavRecord:
    """To a goal at (4, 3), along y = 3."""
    made = record("nts_rgbd", 0, outcome)
    steps = tuple(ImageNavStep(0, x, 3.0, 0.0, 1, False, "explore", 1, 0, 1.0) for x in xs)
    goals = (replace(made.goals[0], distance_m=left_m),)
    return replace(made, steps=steps, goals=goals)


@pytest.mark.parametrize(
    ("outcome", "xs", "left_m", "expected"),
    [
        ("s", [2.0, 4.0], 0.2, None),
        ("w", [2.0], 1.4, "beside_the_goal"),
        ("w", [2.0], 4.0, "wrong_place"),
        ("t", [8.0, 7.8, 9.0] * 60, 5.0, "never_in_sight"),
        ("t", [8.0, 2.0, 9.0] * 60, 5.0, "not_recognized"),
        ("t", [8.0] * 200, 5.0, "stuck"),
    ],
)
def test_failures_are_told_apart(
    outcome: str, xs: list[float], left_m: float, expected: str | None
) -> None:
    assert failure_of(_drive(outcome, xs, left_m), Ground.of(building())) == expected


def test_a_wall_or_three_metres_part_two_nodes() -> None:
    ground = Ground.of(building())
    assert in_one_node(ground, Pose2(3.5, 1.0, 0.0), Pose2(1.5, 1.0, 2.0))
    assert not in_one_node(ground, Pose2(4.5, 1.0, 0.0), Pose2(5.5, 1.0, 0.0))
    assert not in_one_node(ground, Pose2(1.0, 1.0, 0.0), Pose2(4.5, 1.0, 0.0))
