"""Good files of every kind, made once, for the tests to spoil copies of."""

import json
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest
import torch

from tests.data.small_office import save_building
from tests.hostile import answer_of
from tests.worlds.test_stanford import write_area
from toponav.models.checkpoints import save_checkpoint
from toponav.models.graphnav.behavior import BehaviorNetwork
from toponav.models.graphnav.localization import LocalizationNetwork
from toponav.models.graphnav.presets import get_preset

Copy = Callable[[Path], Path]


@dataclass(frozen=True)
class GoodFiles:
    """Where they are; do not change them."""

    root: Path
    building: Path
    dataset: Path
    cache: Path
    weights: Path
    results: Path
    area: Path

    @property
    def map(self) -> Path:
        return self.building / "map.topo.json"


@pytest.fixture(scope="session")
def good(tmp_path_factory: pytest.TempPathFactory) -> GoodFiles:
    root = tmp_path_factory.mktemp("good")
    building = save_building(root)
    files = GoodFiles(
        root=root,
        building=building,
        dataset=root / "dataset",
        cache=root / "cache",
        weights=root / "weights",
        results=root / "results",
        area=_area(root / "area"),
    )
    size = ["--width", 80, "--height", 60, "--episodes", 2]
    _do(
        "collect", "graphnav", "--out", files.dataset, "--buildings", building, *size, watched=root
    )
    _do("data", "prepare", files.dataset, "--out", files.cache, watched=root)
    source = ["--scene", building, "--map", files.map, "--episodes", 1]
    _do("eval", "graphnav", "--agent", "expert", "--out", files.results, *source, watched=root)
    torch.manual_seed(0)
    preset = get_preset("compact")
    for config in preset.behaviors:
        network = BehaviorNetwork(config)
        save_checkpoint(network, files.weights / f"behavior_{config.behavior}")
    save_checkpoint(LocalizationNetwork(preset.localization), files.weights / "localization")
    return files


@pytest.fixture
def copy(tmp_path: Path) -> Copy:
    """Copies a good file or folder to where it may be spoiled."""

    def copied(source: Path) -> Path:
        target = tmp_path / source.name
        if source.is_dir():
            shutil.copytree(source, target)
        else:
            shutil.copy(source, target)
        return target

    return copied


def _do(*words: object, watched: Path) -> None:
    answer = answer_of(words, watched)
    assert answer.status == 0, answer.err


def _area(folder: Path) -> Path:
    folder.mkdir()
    path = write_area(folder, node_sizes=None, invalid_rooms=None)
    (folder / "area_0_graph.json").write_text(json.dumps(drawing()))
    return path


def drawing() -> dict[str, list[list[object]]]:
    """A drawing of the authors' canvas: two rooms and a door, joined in a ring."""
    places = {"n0": ("lobby_1", 15), "n1": ("conferenceRoom_1", 45)}
    places["n2"] = ("conferenceRoom_1_door", 32)
    moves = {"e0 n0 n1": "tr", "e1 n1 n2": "fd", "e2 n2 n0": "tl"}
    texts: list[list[object]] = [[x, 20, {"tags": t, "text": n}] for t, (n, x) in places.items()]
    return {
        "oval": [[x - 1, 19, x + 1, 21, {"tags": tag}] for tag, (_, x) in places.items()],
        "text": texts + [[0, 0, {"tags": tag, "text": code}] for tag, code in moves.items()],
        "line": [[0, 0, 1, 1, {"tags": tag}] for tag in moves],
    }
