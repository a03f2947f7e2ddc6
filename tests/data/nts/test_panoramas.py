"""Panoramas are collected, resumed, read again, and labelled once."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from tests.sim.two_rooms import two_rooms
from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.data.nts import panoramas
from toponav.data.nts.labels import labels_of
from toponav.data.nts.panoramas import (
    HomePanoramas,
    PanoramaConfig,
    collect_panoramas,
    open_panoramas,
)
from toponav.sim.render import make_renderer

CONFIG = PanoramaConfig(homes=2, panoramas=3, height=8, width=32)


@pytest.fixture(autouse=True)
def homes_made() -> Iterator[list[int]]:
    """Stands two rooms in for every home, and lists the seeds of those that were made."""
    made: list[int] = []

    def stand_in(generator: str, seed: int) -> object:
        made.append(seed)
        return two_rooms()

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(panoramas, "suite_scene", stand_in)
        yield made


def test_what_is_stored_is_what_the_camera_saw(tmp_path: Path) -> None:
    homes = collect_panoramas(tmp_path / "nts", CONFIG)
    assert [home.scene_seed for home in homes] == [0, 1]
    renderer = make_renderer(two_rooms(), CONFIG.camera)
    for home in homes:
        for number in range(len(home)):
            pose = Pose2(*home.poses[number].tolist())
            assert home.ground.free[two_rooms().grid.cell_of(pose.x_m, pose.y_m)]
            seen = renderer.render_images(pose, ("rgb", "depth"))
            assert (home.rgb[number] == seen.rgb).all()
            assert home.depth_mm[number] / 1000 == pytest.approx(seen.depth_m, abs=6e-4)


def test_homes_differ_in_where_panoramas_are_taken(tmp_path: Path) -> None:
    first, second = collect_panoramas(tmp_path / "nts", CONFIG)
    assert not (first.poses == second.poses).any()


def test_an_interrupted_collection_goes_on_with_the_missing_home(
    tmp_path: Path, homes_made: list[int]
) -> None:
    whole = collect_panoramas(tmp_path / "whole", CONFIG)
    collect_panoramas(tmp_path / "cut", CONFIG)
    (tmp_path / "cut" / "homes-train-0001" / "home.json").unlink()
    assert len(open_panoramas(tmp_path / "cut", partial=True)) == 1
    with pytest.raises(InputError, match="1 of 2 homes"):
        open_panoramas(tmp_path / "cut")
    homes_made.clear()
    resumed = collect_panoramas(tmp_path / "cut", CONFIG)
    assert homes_made == [1]
    for one, other in zip(whole, resumed, strict=True):
        assert (one.rgb == other.rgb).all()
        assert (one.poses == other.poses).all()


def test_more_homes_are_added_and_another_seed_is_refused(
    tmp_path: Path, homes_made: list[int]
) -> None:
    collect_panoramas(tmp_path, PanoramaConfig(homes=1, panoramas=3, height=8, width=32))
    homes_made.clear()
    assert len(collect_panoramas(tmp_path, CONFIG)) == 2
    assert homes_made == [1]
    with pytest.raises(InputError, match="another collection"):
        collect_panoramas(
            tmp_path, PanoramaConfig(homes=2, panoramas=3, height=8, width=32, seed=1)
        )


def test_labels_are_made_once_and_kept(tmp_path: Path) -> None:
    home = collect_panoramas(tmp_path, CONFIG)[0]
    first = labels_of(home)
    stored = list(home.folder.glob("labels-*.npz"))
    assert len(stored) == 1
    again = labels_of(home)
    for name, value in vars(first).items():
        assert (getattr(again, name) == value).all()
    stored[0].write_bytes(b"broken")
    with pytest.raises(InputError, match="delete the file"):
        labels_of(home)


def test_damaged_images_are_refused(tmp_path: Path) -> None:
    home = collect_panoramas(tmp_path, CONFIG)[0]
    np.save(home.folder / "rgb.npy", np.zeros((1, 2), np.uint8))
    fresh: HomePanoramas = open_panoramas(tmp_path)[0]
    with pytest.raises(InputError, match="rgb"):
        _ = fresh.rgb


def test_a_folder_without_a_collection_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        open_panoramas(tmp_path)


@pytest.mark.parametrize("values", [{"homes": 69}, {"panoramas": 0}, {"width": 30}, {"seed": -1}])
def test_impossible_collections_are_refused(values: dict[str, int]) -> None:
    with pytest.raises(InputError):
        PanoramaConfig(**values)  # type: ignore[arg-type]
