"""Reinforcement learning: robots, checkpoints, and that something is learned."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.training.image_goals.corridor import shelf
from toponav.core.errors import InputError
from toponav.core.imagenav import Action
from toponav.models.baselines.image_goal_presets import ImageGoalKind, image_goal_preset
from toponav.models.baselines.image_goal_weights import load_image_goal
from toponav.training.image_goals.reinforcement_config import (
    ReinforcementConfig,
    reinforcement_config,
)
from toponav.training.image_goals.rollouts import Robots, RolloutSettings

pytest.importorskip("sb3_contrib")

TINY = reinforcement_config("compact").with_changes(
    frames=64,
    robots=2,
    steps=8,
    rollouts_a_segment=2,
    batch_size=8,
    epochs=2,
    validation_episodes=0,
    first_far_m=2.0,
    far_m=2.0,
    workers=0,
)


def trained(
    kind: ImageGoalKind, out: Path, config: ReinforcementConfig = TINY, max_steps: int = 40
) -> list[dict[str, Any]]:
    from toponav.training.image_goals.reinforcement import train_reinforcement

    sizes = image_goal_preset(kind, "compact", depth=True)
    train_reinforcement(sizes, "compact", config, out, shelf=shelf(sizes, max_steps))
    lines = (out / sizes.name / "metrics.jsonl").read_text().splitlines()
    return [json.loads(line) for line in lines]


def robots(count: range) -> Robots:
    config = image_goal_preset("metric_rl", "compact", depth=True)
    return Robots(config, RolloutSettings(), count, 0, shelf(config, 8))


def test_what_a_robot_meets_does_not_depend_on_the_others() -> None:
    together, alone = robots(range(2)), robots(range(1, 2))
    first, one = together.reset(3, 3.0), alone.reset(3, 3.0)
    assert all(np.array_equal(first[1][name], one[0][name]) for name in first[1])
    for action in (Action.FORWARD, Action.LEFT, Action.STOP, Action.FORWARD):
        both = together.step(np.array([Action.FORWARD, action]))
        own = alone.step(np.array([action]))
        assert both[1].reward == own[0].reward
        assert both[1].is_over == own[0].is_over == (action == Action.STOP)
        assert np.array_equal(both[1].inputs["image"], own[0].inputs["image"])


def test_time_that_runs_out_is_told_from_a_stop() -> None:
    crowd = robots(range(1))
    crowd.reset(0, 3.0)
    for _ in range(7):
        assert not crowd.step(np.array([Action.LEFT]))[0].is_over
    over = crowd.step(np.array([Action.LEFT]))[0]
    assert over.is_over
    assert over.info["TimeLimit.truncated"]
    assert over.info["terminal_observation"]["sensors"][Action.LEFT] == 1.0
    assert not over.inputs["sensors"].any()
    stopped = crowd.step(np.array([Action.STOP]))[0]
    assert stopped.is_over
    assert not stopped.info["TimeLimit.truncated"]


@pytest.mark.parametrize("kind", ["target_rl", "metric_rl"])
def test_a_killed_run_ends_as_one_that_was_not(kind: ImageGoalKind, tmp_path: Path) -> None:
    whole = trained(kind, tmp_path / "whole")
    trained(kind, tmp_path / "cut", TINY.with_changes(frames=32))
    resumed = trained(kind, tmp_path / "cut")
    assert [line["frames"] for line in whole] == [32, 64]
    name = image_goal_preset(kind, "compact", depth=True).name
    weights = [(tmp_path / run / f"{name}.safetensors").read_bytes() for run in ("whole", "cut")]
    assert weights[0] == weights[1]
    for one, other in zip(whole, resumed, strict=True):
        assert one | {"frames_per_second": 0} == other | {"frames_per_second": 0}
    assert load_image_goal(name, tmp_path / "cut").config.policy == kind
    about = json.loads((tmp_path / "cut" / f"{name}.json").read_text())["metadata"]
    assert about["frames"] == 64


def test_a_run_is_not_gone_on_with_as_another(tmp_path: Path) -> None:
    trained("target_rl", tmp_path, TINY.with_changes(frames=32))
    with pytest.raises(InputError, match="another configuration"):
        trained("target_rl", tmp_path, TINY.with_changes(seed=1))


def test_goals_come_to_be_farther_while_training_goes_on() -> None:
    config = reinforcement_config("compact")
    assert config.far_after(0) == config.first_far_m
    assert config.far_after(10 * config.curriculum_frames) == config.far_m
    assert reinforcement_config("paper").frames == 25_000_000


@pytest.mark.slow
def test_a_policy_learns_to_stop_where_it_is_at_its_goal(tmp_path: Path) -> None:
    config = TINY.with_changes(
        frames=1024,
        robots=8,
        steps=32,
        rollouts_a_segment=1,
        batch_size=64,
        epochs=6,
        learning_rate=2e-3,
        near_m=0.3,
        first_far_m=0.9,
        far_m=0.9,
    )
    lines = trained("target_rl", tmp_path, config)
    first, last = lines[0], lines[-1]
    # A new policy wanders for twenty steps or so; what comes of it in as many frames says more
    # than the few that had ended.
    assert first["episodes"] < 20
    assert last["episodes"] > 3 * first["episodes"]
    assert last["length"] < 6.0
    assert last["train_success"] > 0.85
