"""The probe of room kinds sees what it should and can tell what can be told."""

import numpy as np
import torch

from tests.sim.buildings import furnished_room
from toponav.core.vocabulary import RoomKind
from toponav.evaluation.benchmarks.render import furnished_rates
from toponav.evaluation.benchmarks.room_kind import RoomKindNet, _as_input, _train, room_panoramas
from toponav.worlds.scene import Room, Scene, scene_from_heights


def two_rooms() -> Scene:
    plan = furnished_room()
    index = np.where(np.arange(plan.grid.cols) < 30, 0, 1)
    return scene_from_heights(
        "two",
        plan.grid,
        plan.heights_m,
        ceiling_m=plan.ceiling_m,
        room_index=np.broadcast_to(index, plan.grid.shape).copy(),
        rooms=[Room("a", RoomKind.KITCHEN), Room("b", RoomKind.BEDROOM)],
        semantics=plan.semantics,
    )


def test_panoramas_come_from_every_room_with_its_kind() -> None:
    images, kinds = room_panoramas(two_rooms(), 3, np.random.default_rng(0))
    assert kinds == ["kitchen"] * 3 + ["bedroom"] * 3
    assert images.shape == (6, 32, 128, 3)
    assert images.std() > 5


def test_network_sees_the_same_wherever_the_panorama_begins() -> None:
    net = RoomKindNet(3).eval()
    x = torch.rand(2, 3, 32, 128, generator=torch.Generator().manual_seed(0))
    with torch.inference_mode():
        torch.testing.assert_close(net(x), net(x.roll(16, dims=-1)), atol=1e-4, rtol=1e-4)


def test_probe_learns_what_colour_tells() -> None:
    rng = np.random.default_rng(0)
    labels = np.arange(16) % 2
    images = rng.integers(90, 130, (16, 16, 32, 3)).astype(np.uint8)
    images[labels == 1, :, :, 0] += 60
    net = _train(images, labels, 2, epochs=15, seed=0)
    with torch.inference_mode():
        assert (net(_as_input(images)).argmax(dim=1).numpy() == labels).mean() > 0.9


def test_rates_of_a_furnished_building_are_frames_a_second() -> None:
    rates = furnished_rates(two_rooms(), repeats=1, frames=2)
    assert set(rates) >= {
        "panorama_rgbd_128x512_fps_per_core",
        "depth_320x240_furnished_fps_per_core",
    }
    assert all(5 < rate < 1e5 for rate in rates.values())
