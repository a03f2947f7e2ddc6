import pytest
import torch

from toponav.core.errors import InputError
from toponav.core.vocabulary import Behavior
from toponav.models.baselines.behavrnn import BehavRNN
from toponav.models.baselines.image_goal import ImageGoalNetwork
from toponav.models.baselines.image_goal_presets import image_goal_preset
from toponav.models.baselines.image_goal_weights import load_image_goal, open_eyes
from toponav.models.baselines.phasenet import PhaseNet
from toponav.models.baselines.presets import get_baseline_preset
from toponav.models.checkpoints import (
    load_behavrnn,
    load_phasenet,
    load_weights,
    save_checkpoint,
)
from toponav.models.graphnav.behavior import BehaviorNetwork
from toponav.models.graphnav.localization import LocalizationNetwork
from toponav.models.graphnav.presets import get_preset
from toponav.training.release import release_weights


def save_run(path) -> None:
    preset = get_preset("compact")
    for behavior in Behavior:
        network = BehaviorNetwork(preset.behavior(behavior))
        save_checkpoint(network, path / f"behavior_{behavior}", {"seed": 3})
    save_checkpoint(LocalizationNetwork(preset.localization), path / "localization", {"seed": 3})


def test_released_weights_are_half_as_large_and_load_the_same(tmp_path) -> None:
    save_run(tmp_path / "run")
    released = release_weights(tmp_path / "run", tmp_path / "out")
    whole = sum(path.stat().st_size for path in (tmp_path / "run").iterdir())
    assert released["bytes"] < 0.55 * whole
    assert released["bytes"] < 15e6
    before, after = load_weights(tmp_path / "run"), load_weights(tmp_path / "out")
    for mine, theirs in zip(
        before.localization.parameters(), after.localization.parameters(), strict=True
    ):
        torch.testing.assert_close(mine, theirs, atol=1e-3, rtol=1e-3)


def test_baselines_are_released_where_there_are_any(tmp_path) -> None:
    save_run(tmp_path / "run")
    baselines = get_baseline_preset("compact")
    save_checkpoint(PhaseNet(baselines.phasenet), tmp_path / "run" / "phasenet", {"seed": 3})
    save_checkpoint(BehavRNN(baselines.behavrnn), tmp_path / "run" / "behavrnn", {"seed": 3})
    released = release_weights(tmp_path / "run", tmp_path / "out")
    for name in ("phasenet", "behavrnn"):
        assert released["networks"][name] < 2e6
    assert load_phasenet(tmp_path / "out").config == baselines.phasenet
    assert load_behavrnn(tmp_path / "out").config == baselines.behavrnn


def test_image_goal_policies_are_released_with_their_eyes(tmp_path) -> None:
    network = open_eyes(ImageGoalNetwork(image_goal_preset("metric_rl", "compact", depth=True)))
    save_checkpoint(network, tmp_path / "run" / "metric_map_rl_rgbd", {"frames": 7})
    released = release_weights(tmp_path / "run", tmp_path / "out")
    assert released["networks"]["metric_map_rl_rgbd"] < 2.5e6
    again = load_image_goal("metric_map_rl_rgbd", tmp_path / "out")
    for mine, theirs in zip(network.parameters(), again.parameters(), strict=True):
        torch.testing.assert_close(mine, theirs, atol=1e-3, rtol=1e-3)


def test_a_run_without_localization_is_refused(tmp_path) -> None:
    save_run(tmp_path / "run")
    (tmp_path / "run" / "localization.safetensors").unlink()
    with pytest.raises(InputError, match="localization"):
        release_weights(tmp_path / "run", tmp_path / "out")
