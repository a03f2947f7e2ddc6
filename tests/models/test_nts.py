"""The multi-task network of Neural Topological SLAM."""

import numpy as np
import pytest
import torch

from toponav.core.camera import PanoramaCamera
from toponav.core.errors import InputError
from toponav.models.checkpoints import load_checkpoint, save_checkpoint
from toponav.models.nts.encoder import folded
from toponav.models.nts.network import NTSNetwork
from toponav.models.nts.panorama import (
    column_yaw_rad,
    horizontal_scale,
    network_input,
    obstacle_profile,
    sight_profile,
)
from toponav.models.nts.presets import NTSConfig, get_nts_preset


def _network(*, depth: bool = True) -> NTSNetwork:
    torch.manual_seed(0)
    return NTSNetwork(NTSConfig(depth=depth, width=8, features=16, hidden=16)).eval()


def _images(count: int, channels: int = 4) -> torch.Tensor:
    generator = torch.Generator().manual_seed(1)
    shape = (count, channels, 32, 144)
    return torch.randint(0, 256, shape, generator=generator, dtype=torch.uint8)


def test_columns_look_where_the_cameras_rays_go() -> None:
    rays = PanoramaCamera().rays_in_robot()[64]
    assert np.allclose(np.arctan2(rays[:, 1], rays[:, 0]), column_yaw_rad(512), atol=1e-5)
    assert np.allclose(np.hypot(rays[:, 0], rays[:, 1]), horizontal_scale(512), atol=1e-5)


@torch.inference_mode()
def test_turned_source_turns_every_answer() -> None:
    network, images = _network(), _images(4)
    turned = images.roll(12, 3)
    here, there = network.encode(images), network.encode(turned)
    one, other = network.pair(here[:2], here[2:]), network.pair(there[:2], here[2:])
    assert torch.allclose(one.direction.roll(1, 1), other.direction, atol=2e-3)
    assert torch.allclose(one.score.roll(1, 1), other.score, atol=2e-3)
    assert torch.allclose(one.connection, other.connection, atol=2e-3)
    place, turned_place = network.place(here), network.place(there)
    assert torch.allclose(place.explorable.roll(1, 1), turned_place.explorable, atol=2e-3)
    assert torch.allclose(place.sight_m.roll(6, 1), turned_place.sight_m, atol=2e-3)


@torch.inference_mode()
def test_turned_goal_changes_nothing() -> None:
    network, images = _network(), _images(4)
    features = network.encode(images)
    one = network.pair(features[:2], features[2:])
    other = network.pair(features[:2], network.encode(images[2:].roll(20, 3)))
    assert torch.allclose(one.direction, other.direction, atol=2e-3)
    assert torch.allclose(one.distance_m, other.distance_m, atol=2e-3)


def test_gradients_reach_every_parameter() -> None:
    network = _network()
    network.train()
    pair, place = network(_images(3), _images(3))
    total = pair.connection.sum() + pair.direction[:, 0].sum() + pair.distance_m.sum()
    total = total + pair.score.sum() + place.explorable.sum()
    (total + (place.obstacle_m + place.sight_m).sum()).backward()
    assert [name for name, value in network.named_parameters() if value.grad is None] == []


def test_checkpoint_gives_the_same_answers(tmp_path) -> None:  # type: ignore[no-untyped-def]
    network = _network(depth=False)
    save_checkpoint(network, tmp_path / "nts_rgb")
    loaded = load_checkpoint(tmp_path / "nts_rgb")
    assert isinstance(loaded, NTSNetwork)
    images = _images(2, channels=3)
    with torch.inference_mode():
        one, _ = network(images, images)
        other, _ = loaded(images, images)
    assert torch.equal(one.connection, other.connection)


@pytest.mark.slow
@torch.inference_mode()
def test_paper_preset_takes_whole_panoramas() -> None:
    network = NTSNetwork(get_nts_preset("paper", depth=False)).eval()
    images = torch.zeros(1, 3, 128, 512, dtype=torch.uint8)
    pair, place = network(images, images)
    assert pair.score.shape == (1, 12)
    assert place.explorable.shape == (1, 12)


def test_sizes_that_do_not_fit_are_refused() -> None:
    with pytest.raises(InputError, match="cols"):
        NTSConfig(cols=100)


def _corridor() -> tuple[np.ndarray, np.ndarray]:
    """Depth of walls 1 m to the left and right, 4 m ahead, 2 m behind, and matching colours."""
    yaw, scale = column_yaw_rad(512), horizontal_scale(512)
    with np.errstate(divide="ignore"):
        side = np.where(np.abs(np.sin(yaw)) > 1e-6, 1.0 / np.abs(np.sin(yaw)), np.inf)
        end = np.where(np.cos(yaw) > 0, 4.0, 2.0) / np.abs(np.cos(yaw))
    depth_m = np.broadcast_to(np.minimum(side, end) / scale, (128, 512)).astype(np.float32)
    rgb = np.zeros((128, 512, 3), np.uint8)
    rgb[:, np.abs(yaw) < 0.2] = (255, 0, 0)
    rgb[:, np.abs(yaw - np.pi / 2) < 0.2] = (0, 255, 0)
    return rgb, np.ascontiguousarray(depth_m)


def test_profiles_measure_the_walls() -> None:
    _, depth_m = _corridor()
    for profile in (sight_profile(depth_m, 72), obstacle_profile(depth_m, 72)):
        assert profile[18] == pytest.approx(1.0, abs=0.05)
        assert profile[54] == pytest.approx(1.0, abs=0.05)
        assert profile[36] == pytest.approx(2.0, abs=0.05)
    assert sight_profile(depth_m, 72)[0] == pytest.approx(4.0, abs=0.05)


def test_input_has_forward_first_and_left_after_it() -> None:
    rgb, depth_m = _corridor()
    seen = network_input(rgb, depth_m, NTSConfig(depth=True))
    assert seen[0, 16, 1:3].min() > 200
    assert seen[1, 16, 37:39].min() > 200
    assert seen[3, 16, 37] > seen[3, 16, 1]


@torch.inference_mode()
def test_folded_network_says_the_same_in_fewer_layers() -> None:
    network, images = _network(), _images(2)
    for module in network.modules():
        if isinstance(module, torch.nn.BatchNorm2d):
            module.running_mean += 0.3
            module.running_var *= 1.7
    quick = folded(network)
    one, other = network.encode(images), quick.encode(images)
    assert torch.allclose(one, other, atol=1e-4)
    here, there = network.pair(one, one.flip(0)), quick.pair(other, other.flip(0))
    assert torch.allclose(here.score, there.score, atol=1e-4)
    assert not any(isinstance(module, torch.nn.BatchNorm2d) for module in quick.modules())
    assert any(isinstance(module, torch.nn.BatchNorm2d) for module in network.modules())
