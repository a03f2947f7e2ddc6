"""The learned baselines of image goals that ship."""

from pathlib import Path

import pytest

import toponav
from toponav.evaluation.imagenav.agents import TABLE_AGENTS, table_agents
from toponav.models.baselines.image_goal_weights import load_image_goal, ships
from toponav.models.checkpoints import checkpoint_metadata

FOLDER = Path(toponav.__file__).parent / "weights" / "imagenav"
SHIPPED = ("il_rgbd", "target_rl_rgbd", "metric_map_rl_rgbd")


@pytest.mark.parametrize("name", SHIPPED)
def test_a_baseline_ships_with_eyes_and_a_record_of_its_training(name: str) -> None:
    network = load_image_goal(name)
    assert network.config.name == name
    assert network.sight is not None
    about = checkpoint_metadata(FOLDER / name)["metadata"]
    assert about["frames"] > 0
    assert about["environment"]


def test_all_agents_are_those_of_the_tables_whose_weights_ship() -> None:
    assert set(SHIPPED) <= set(table_agents()) <= set(TABLE_AGENTS)
    assert not ships("il_rgbd_of_nobody")


def test_what_ships_is_small() -> None:
    assert sum(path.stat().st_size for path in FOLDER.iterdir()) < 6e6


def test_reinforced_baselines_saw_as_many_frames() -> None:
    frames = {
        checkpoint_metadata(FOLDER / name)["metadata"]["frames"]
        for name in SHIPPED
        if name != "il_rgbd"
    }
    assert len(frames) == 1
