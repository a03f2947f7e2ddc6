"""Demonstrations of the expert, and learning from them."""

from pathlib import Path

import numpy as np
import pytest
import torch

from tests.training.image_goals.corridor import corridor
from toponav.cli._collect_imitation import collect_imitation
from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.core.imagenav import Action
from toponav.data.nts.shortest_path import ShortestPathAgent
from toponav.models.baselines.image_goal import ImageGoalNetwork
from toponav.models.baselines.image_goal_presets import SENSORS, image_goal_preset
from toponav.models.baselines.image_goal_weights import open_eyes
from toponav.models.checkpoints import save_checkpoint
from toponav.sim.imagenav import ImageNavSimulation
from toponav.training.config import default_config
from toponav.training.image_goals.demonstrations import (
    DemonstrationConfig,
    HomeDrives,
    collect_demonstrations,
    open_demonstrations,
)
from toponav.training.image_goals.homes import camera_of
from toponav.training.image_goals.imitation_recipe import train_imitation
from toponav.training.image_goals.imitation_task import ImitationTask, _mirrored
from toponav.training.image_goals.seen_drives import seen_in

CONFIG = DemonstrationConfig(homes=1, episodes=2, far_m=3.0, max_steps=60)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("drives")
    collect_demonstrations(out, CONFIG)
    return out


def test_drives_end_at_their_goals_with_a_stop(folder: Path) -> None:
    (home,) = open_demonstrations([folder])
    assert home.reached == 2
    last = np.flatnonzero(np.diff(home.episode, append=-1))
    assert [Action(int(action)) for action in home.action[last]] == [Action.STOP] * 2
    assert (home.action == Action.STOP).sum() == 2
    # What is felt is what was done before.
    done = home.sensors[1 : last[0] + 1, :4].argmax(1)
    assert done.tolist() == home.action[: last[0]].tolist()
    assert not home.sensors[0].any()


def test_a_collection_is_not_driven_again(folder: Path) -> None:
    written = {path: path.stat().st_mtime_ns for path in folder.glob("*/*.npy")}
    collect_demonstrations(folder, CONFIG)
    assert {path: path.stat().st_mtime_ns for path in folder.glob("*/*.npy")} == written


def test_another_collection_does_not_go_into_the_folder(folder: Path) -> None:
    with pytest.raises(InputError, match="another collection"):
        collect_demonstrations(folder, DemonstrationConfig(homes=1, episodes=3))


def test_a_learner_drives_where_the_expert_says_what_to_do(tmp_path: Path) -> None:
    torch.manual_seed(0)
    network = ImageGoalNetwork(image_goal_preset("il", "compact", depth=True))
    save_checkpoint(network, tmp_path / "il_rgbd")
    config = DemonstrationConfig(
        homes=1, episodes=1, far_m=3.0, max_steps=40, learner=str(tmp_path), expert_share=0.0
    )
    (home,) = collect_demonstrations(tmp_path / "round", config)
    done = home.sensors[1:, :4].argmax(1)
    assert (done != home.action[:-1]).any()
    assert not (done == Action.STOP).any()


def test_the_learner_is_the_imitator_of_the_modality(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"have no il_rgb\b"):
        collect_imitation(out=tmp_path / "round", homes=1, modality="rgb", learner=str(tmp_path))


def test_the_expert_finds_out_of_where_no_path_leads() -> None:
    simulation = ImageNavSimulation(corridor(), camera_of(CONFIG.network), noise=None)
    expert = ShortestPathAgent()
    expert.attach_truth(simulation)
    expert.reset(simulation.reset(Pose2(1.5, 0.7, 0.0), Pose2(6.0, 0.7, 0.0)))
    assert expert._field is not None
    expert._field[:, :60] = np.inf
    assert expert.act(simulation.observe()) == Action.FORWARD


def drives(steps: int = 12) -> HomeDrives:
    """Turn left until the goal is ahead, which a mark of the picture shows, then stop."""
    rng = np.random.default_rng(0)
    image = np.zeros((2 * steps, 4, 32, 144), np.uint8)
    action = np.full(2 * steps, int(Action.LEFT), np.int8)
    for k in range(2 * steps):
        left = k % steps == steps - 1
        image[k] = rng.integers(0, 20, (4, 32, 144))
        if left:
            image[k, 0], action[k] = 250, int(Action.STOP)
    return HomeDrives(
        image,
        rng.integers(0, 255, (2, 4, 32, 144), np.uint8),
        np.zeros((2 * steps, SENSORS), np.float32),
        action,
        np.repeat(np.arange(2, dtype=np.int32), steps),
        2,
        "made-up",
    )


def test_mirrored_drives_turn_the_other_way() -> None:
    rng = np.random.default_rng(1)
    part = {
        "image": rng.integers(0, 255, (3, 4, 32, 96), np.uint8),
        "goal": rng.integers(0, 255, (4, 32, 96), np.uint8),
        "sensors": rng.random((3, SENSORS), np.float32),
        "action": np.array([1, 2, 3]),
    }
    once = _mirrored(part)
    assert once["action"].tolist() == [1, 3, 2]
    assert np.array_equal(once["sensors"][..., 2], part["sensors"][..., 3])
    # The four columns that become the direction ahead stay ahead.
    assert np.array_equal(once["image"][..., :4], part["image"][..., 3::-1])
    twice = _mirrored(once)
    assert all(np.array_equal(twice[name], part[name]) for name in part)


def test_drives_are_looked_at_once(folder: Path) -> None:
    network = open_eyes(ImageGoalNetwork(image_goal_preset("il", "compact", depth=True)))
    assert network.sight is not None
    (home,) = open_demonstrations([folder])
    seen = seen_in(home, network.sight, "float32")
    features = network.encode(torch.from_numpy(np.array(home.image[:1])))
    goal = network.encode(torch.from_numpy(np.array(home.goal[:1])))
    said = network.sight.compare(features, goal)[0].numpy()
    np.testing.assert_allclose(seen[0], said, rtol=2e-3, atol=2e-3)
    (path,) = folder.glob("*/seen-*-as-is.npy")
    before = path.stat().st_mtime_ns
    assert np.array_equal(seen, seen_in(home, network.sight, "float32"))
    assert path.stat().st_mtime_ns == before


def test_drives_of_the_other_modality_are_refused(folder: Path, tmp_path: Path) -> None:
    config = default_config("compact", "il").with_changes(epochs=1)
    sizes = image_goal_preset("il", "compact", depth=False)
    with pytest.raises(InputError, match="32x144 pixels, and il_rgb sees 3 of 64x144"):
        train_imitation([folder], [], sizes, "compact", config, tmp_path)


def test_a_policy_learns_what_it_is_shown() -> None:
    torch.manual_seed(0)
    config = default_config("compact", "il").with_changes(
        batch_size=2, sequence_steps=8, mirror=False
    )
    network = open_eyes(ImageGoalNetwork(image_goal_preset("il", "compact", depth=True)))
    task = ImitationTask(network, [drives()], [], config)
    optimizer = torch.optim.Adam(network.parameters(), 2e-3)
    assert task.samples == 2
    for batch in task.batches(np.random.default_rng(0), 25):
        assert len(batch.action) <= 8
        optimizer.zero_grad()
        task.loss(network, batch).backward()  # type: ignore[no-untyped-call]
        optimizer.step()
    found = task.evaluate(network)
    assert found["accuracy"] > 0.95
    assert found["stop_recall"] == 1.0


def test_the_recipe_writes_weights_and_what_they_saw(folder: Path, tmp_path: Path) -> None:
    config = default_config("compact", "il").with_changes(epochs=1, batch_size=2)
    sizes = image_goal_preset("il", "compact", depth=True)
    result = train_imitation([folder], [], sizes, "compact", config, tmp_path)
    assert result.checkpoint == tmp_path / "il_rgbd.safetensors"
    assert result.checkpoint.is_file()
    assert 0.0 <= result.metrics["accuracy"] <= 1.0
