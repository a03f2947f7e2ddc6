"""Policies from panoramas to actions: shapes, turned goals, storage."""

import dataclasses
from pathlib import Path

import pytest
import torch

from toponav.core.errors import InputError
from toponav.models.baselines.image_goal import ImageGoalNetwork
from toponav.models.baselines.image_goal_presets import (
    MAP_CELLS,
    MAP_CHANNELS,
    SENSORS,
    ImageGoalConfig,
    ImageGoalKind,
    image_goal_preset,
)
from toponav.models.baselines.image_goal_weights import load_image_goal, open_eyes
from toponav.models.checkpoints import load_nts, save_checkpoint

KINDS: tuple[ImageGoalKind, ...] = ("il", "target_rl", "metric_rl")


def sensed(config: ImageGoalConfig, batch: int, seed: int = 0) -> dict[str, torch.Tensor]:
    rng = torch.Generator().manual_seed(seed)
    shape = (batch, config.channels, config.rows, config.cols)
    found = {
        "image": torch.randint(0, 256, shape, generator=rng, dtype=torch.uint8),
        "goal": torch.randint(0, 256, shape, generator=rng, dtype=torch.uint8),
        "sensors": torch.rand(batch, SENSORS, generator=rng),
    }
    if config.metric_map:
        shape = (batch, MAP_CHANNELS, MAP_CELLS, MAP_CELLS)
        found["map"] = torch.randint(0, 256, shape, generator=rng, dtype=torch.uint8)
    return found


@pytest.mark.parametrize("kind", KINDS)
def test_a_batch_says_what_its_members_say(kind: ImageGoalKind) -> None:
    config = image_goal_preset(kind, "compact", depth=True)
    network = ImageGoalNetwork(config).eval()
    inputs = sensed(config, 3)
    together, _ = network(inputs, network.begin(3))
    for k in range(3):
        one = {name: value[k : k + 1] for name, value in inputs.items()}
        alone, _ = network(one, network.begin())
        torch.testing.assert_close(together[k], alone[0], atol=1e-5, rtol=1e-5)


@pytest.mark.parametrize("kind", KINDS)
def test_every_weight_is_learned(kind: ImageGoalKind) -> None:
    config = image_goal_preset(kind, "compact", depth=True)
    network = ImageGoalNetwork(config)
    logits, memory = network(sensed(config, 2), network.begin(2))
    logits, _ = network(sensed(config, 2, seed=1), memory)
    logits.square().sum().backward()
    assert logits.shape == (2, 4)
    for name, weight in network.named_parameters():
        if name.startswith("sight."):
            assert weight.grad is None, name
            continue
        assert weight.grad is not None, name
        assert bool(weight.grad.abs().sum() > 0), name


def test_it_does_not_matter_which_way_the_goals_camera_looked() -> None:
    config = image_goal_preset("il", "compact", depth=False)
    network = ImageGoalNetwork(config).eval()
    inputs = sensed(config, 2)
    before, _ = network(inputs, network.begin(2))
    turned = dict(inputs, goal=inputs["goal"].roll(36, -1))
    after, _ = network(turned, network.begin(2))
    torch.testing.assert_close(before, after, atol=1e-4, rtol=1e-4)


def test_steps_one_by_one_are_a_sequence_at_once() -> None:
    config = image_goal_preset("metric_rl", "compact", depth=True)
    network = ImageGoalNetwork(config).eval()
    hidden = torch.rand(4, 2, config.hidden)
    at_once, _ = network.remember(hidden, network.begin(2))
    memory = network.begin(2)
    for k in range(4):
        step, memory = network.remember(hidden[k : k + 1], memory)
        torch.testing.assert_close(step[0], at_once[k])


def test_a_policy_is_stored_under_its_agents_name(tmp_path: Path) -> None:
    config = image_goal_preset("metric_rl", "compact", depth=True)
    network = ImageGoalNetwork(config).eval()
    save_checkpoint(network, tmp_path / config.name)
    again = load_image_goal("metric_map_rl_rgbd", tmp_path)
    assert again.config == config
    one, _ = network(sensed(config, 1), network.begin())
    other, _ = again(sensed(config, 1), again.begin())
    assert torch.equal(one, other)


def test_missing_weights_say_how_to_train_them(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="toponav train metric_rl"):
        load_image_goal("metric_map_rl_rgbd", tmp_path)


def test_a_metric_map_needs_depth() -> None:
    with pytest.raises(InputError, match="projected from depth"):
        image_goal_preset("metric_rl", "compact", depth=False)


def test_the_papers_policies_see_whole_panoramas() -> None:
    for kind in KINDS:
        config = image_goal_preset(kind, "paper", depth=True)
        assert (config.rows, config.cols, config.encoder) == (128, 512, "resnet18")


def test_a_new_policy_sees_as_the_network_does_whose_eyes_it_opens() -> None:
    config = image_goal_preset("target_rl", "compact", depth=True)
    network, other = open_eyes(ImageGoalNetwork(config)), load_nts(depth=True)
    pictures = sensed(config, 2)["image"]
    features = network.train().encode(pictures)
    assert torch.equal(features, other.encode(pictures))
    assert network.sight is not None
    said = network.sight.compare(features[:1], features[1:])
    assert said.shape == (1, config.seen_size)
    with pytest.raises(InputError, match="not of the sizes"):
        open_eyes(ImageGoalNetwork(dataclasses.replace(config, features=32)))
