"""Any bytes at all: a reader returns what it reads or raises the one error that names the file."""

import hashlib
import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings

from tests.end_to_end.conftest import GoodFiles
from tests.hostile import Damage, damaged, damages
from toponav.core.errors import InputError
from toponav.data.dataset import INDEX_COLUMNS, read_manifest, read_table
from toponav.data.storage import check_bag, depth_images, read_summary, read_trajectory
from toponav.data.training_set import TrainingSet
from toponav.evaluation.records import load_episode
from toponav.evaluation.tables import load_results
from toponav.maps.formats.canvas import load_area_map
from toponav.maps.spec import load_map
from toponav.maps.validate import check_file
from toponav.models.checkpoints import load_checkpoint
from toponav.worlds.load.stanford import load_area, load_pairs
from toponav.worlds.storage import load_scene

Read = Callable[[Path], object]


def _bag(path: Path) -> None:
    check_bag(path)
    read_summary(path)
    read_trajectory(path)
    for _ in depth_images(path):
        pass


def _sealed(path: Path) -> None:
    """As a thorough attacker has it: the digest fits the damage."""
    sidecar = path.with_suffix(".json")
    document = json.loads(sidecar.read_text())
    document["sha256"] = hashlib.sha256(path.read_bytes()).hexdigest()
    sidecar.write_text(json.dumps(document))
    load_checkpoint(path)


def _area_of(path: Path) -> Path:
    return path.with_name("area_0.yaml")


READERS: dict[str, tuple[Callable[[GoodFiles], Path], Read]] = {
    "area yaml": (lambda good: good.area, load_area),
    "floor plan": (lambda good: good.area.with_suffix(".png"), lambda p: load_area(_area_of(p))),
    "rooms": (lambda good: good.area.with_suffix(".mat"), lambda p: load_area(_area_of(p))),
    "drawing": (
        lambda good: good.area.with_name("area_0_graph.json"),
        lambda p: load_area_map(_area_of(p)),
    ),
    "pairs": (lambda good: good.area.with_name("area_0_plans.json"), load_pairs),
    "map": (lambda good: good.map, lambda p: (load_map(p), check_file(p))),
    "scene": (lambda good: good.building / "scene.json", lambda p: load_scene(p.parent)),
    "arrays": (lambda good: good.building / "arrays.npz", lambda p: load_scene(p.parent)),
    "network": (
        lambda good: good.weights / "behavior_straight.json",
        lambda p: load_checkpoint(p.with_suffix(".safetensors")),
    ),
    "weights": (lambda good: good.weights / "behavior_straight.safetensors", load_checkpoint),
    "sealed weights": (lambda good: good.weights / "behavior_straight.safetensors", _sealed),
    "bag": (lambda good: good.dataset / "trajectories" / "000000.mcap", _bag),
    "manifest": (lambda good: good.dataset / "dataset.json", lambda p: read_manifest(p.parent)),
    "index": (
        lambda good: good.dataset / "index.parquet",
        lambda p: read_table(p, "index again", INDEX_COLUMNS).to_pylist(),
    ),
    "cache": (lambda good: good.cache / "cache.json", lambda p: TrainingSet.open(p.parent)),
    "columns": (lambda good: good.cache / "columns.npz", lambda p: TrainingSet.open(p.parent)),
    "frames": (lambda good: good.cache / "frames.npy", lambda p: TrainingSet.open(p.parent)),
    "results": (lambda good: good.results / "results.json", lambda p: load_results(p.parent)),
    "episode": (
        lambda good: next((good.results / "episodes").rglob("*.parquet")),
        load_episode,
    ),
}


@pytest.mark.parametrize("kind", READERS)
def test_damaged_bytes_raise_one_error_or_none(kind: str, good: GoodFiles, tmp_path: Path) -> None:
    _fuzz(kind, good, tmp_path, examples=25)


@pytest.mark.slow
@pytest.mark.parametrize("kind", READERS)
def test_much_damaged_bytes_raise_one_error_or_none(
    kind: str, good: GoodFiles, tmp_path: Path
) -> None:
    _fuzz(kind, good, tmp_path, examples=600)


def _fuzz(kind: str, good: GoodFiles, tmp_path: Path, examples: int) -> None:
    find, read = READERS[kind]
    source = find(good)
    folder = Path(shutil.copytree(source.parent, tmp_path / "copy"))
    path, content = folder / source.name, source.read_bytes()

    @settings(
        max_examples=examples,
        deadline=None,
        database=None,
        suppress_health_check=list(HealthCheck),
    )
    @given(damages())
    def check(what: list[Damage]) -> None:
        path.write_bytes(damaged(content, what))
        fault = _fault(read, path)
        if fault is not None:
            assert str(folder) in fault.where, fault
            assert fault.remedy
            assert len(str(fault)) < 1500

    check()


def _fault(read: Read, path: Path) -> InputError | None:
    try:
        read(path)
    except InputError as error:
        return error
    return None
