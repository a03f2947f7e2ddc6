"""Weights, datasets, caches and results of strangers: one clear error, and nothing is harmed."""

import io
import json
import shutil
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from tests.end_to_end.conftest import Copy, GoodFiles
from tests.hostile import SPOILERS, Spoil, answer_of, assert_one_clear_error, cut, huge


def _npz(**arrays: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **arrays)
    return buffer.getvalue()


@pytest.mark.parametrize("spoil", SPOILERS)
@pytest.mark.parametrize("name", ["localization.json", "localization.safetensors"])
def test_files_of_weights(
    good: GoodFiles, copy: Copy, tmp_path: Path, name: str, spoil: Spoil
) -> None:
    weights = copy(good.weights)
    spoil(weights / name)
    source = ["--scene", good.building, "--map", good.map, "--weights", weights]
    words = ["eval", "graphnav", "--agent", "graphnav_pf", "--out", tmp_path / "o", *source]
    assert_one_clear_error(answer_of(words, tmp_path), names=weights / name)


@pytest.mark.parametrize("spoil", SPOILERS)
@pytest.mark.parametrize("name", ["cache.json", "frames.npy", "columns.npz"])
def test_files_of_a_training_cache(
    good: GoodFiles, copy: Copy, tmp_path: Path, name: str, spoil: Spoil
) -> None:
    if name != "cache.json" and spoil is huge:
        pytest.skip("further bytes are not read")
    cache = copy(good.cache)
    spoil(cache / name)
    words = ["train", "localization", "--data", cache, "--out", tmp_path / "o", "--epochs", 1]
    assert_one_clear_error(answer_of(words, tmp_path), names=cache)


@pytest.mark.parametrize("column", ["plan_edge", "trajectory", "edge_behavior", "command"])
def test_labels_out_of_range(good: GoodFiles, copy: Copy, tmp_path: Path, column: str) -> None:
    cache = copy(good.cache)
    arrays = dict(np.load(cache / "columns.npz"))
    arrays[column] = np.full_like(arrays[column], np.nan if column == "command" else 99)
    (cache / "columns.npz").write_bytes(_npz(**arrays))
    words = ["train", "localization", "--data", cache, "--out", tmp_path / "o", "--epochs", 1]
    answer = answer_of(words, cache)
    assert_one_clear_error(answer, names=cache)


@pytest.mark.parametrize("spoil", SPOILERS)
@pytest.mark.parametrize("name", ["dataset.json", "index.parquet", "trajectories/000000.mcap"])
def test_files_of_a_dataset(
    good: GoodFiles, copy: Copy, tmp_path: Path, name: str, spoil: Spoil
) -> None:
    dataset = copy(good.dataset)
    spoil(dataset / name)
    if name == "dataset.json" and spoil is Path.unlink:
        name = ""
    command = ["export", dataset, "--out", tmp_path / "o"]
    if not name.startswith("traj"):
        command = ["info", dataset]
    answer = answer_of(["data", *command], tmp_path)
    assert_one_clear_error(answer, names=dataset / name)


@pytest.mark.parametrize("name", ["..", "../../precious", "{root}/precious", ""])
@pytest.mark.parametrize("command", ["verify", "repair"])
def test_a_manifest_cannot_reach_out_of_its_folder(
    good: GoodFiles, copy: Copy, tmp_path: Path, command: str, name: str
) -> None:
    (tmp_path / "precious").mkdir()
    (tmp_path / "precious" / "thesis.tex").write_text("years of work")
    dataset = copy(good.dataset)
    manifest = json.loads((dataset / "dataset.json").read_text())
    buildings = manifest["buildings"]
    buildings[name.format(root=tmp_path)] = buildings.pop("small_office")
    (dataset / "dataset.json").write_text(json.dumps(manifest))
    answer = answer_of(["data", command, dataset], tmp_path)
    assert_one_clear_error(answer, names=dataset / "dataset.json", says="must be the plain name")


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"schema": 2}, "schema must be 1, got 2"),
        ({"episodes": 10**12}, "0..10,000,000"),
        ({"episodes": -1}, "0..10,000,000"),
        ({"buildings": 5}, "lacks or garbles"),
        ({"trajectories": {"x": {}}}, "lacks or garbles"),
    ],
)
def test_what_a_manifest_says(
    good: GoodFiles, copy: Copy, tmp_path: Path, change: dict[str, object], says: str
) -> None:
    dataset = copy(good.dataset)
    manifest = json.loads((dataset / "dataset.json").read_text())
    (dataset / "dataset.json").write_text(json.dumps(manifest | change))
    answer = answer_of(["data", "verify", dataset], tmp_path)
    assert_one_clear_error(answer, names=dataset / "dataset.json", says=says)


@pytest.mark.parametrize("command", ["info", "prepare"])
@pytest.mark.parametrize(
    ("column", "value", "says"),
    [
        ("building", "../../precious", "must be the plain name"),
        ("frames", -7, "cannot have -7 frames"),
        ("frames", "many", "'frames' that is missing or not int"),
        ("frames", None, "gaps in the column 'frames'"),
        ("plan_nodes", "office_1", "'plan_nodes' that is missing or not names"),
    ],
)
def test_what_an_index_says(
    good: GoodFiles,
    copy: Copy,
    tmp_path: Path,
    command: str,
    column: str,
    value: object,
    says: str,
) -> None:
    if command == "info" and not says.endswith(("int", "names", "'frames'")):
        pytest.skip("shown as it is")
    dataset = copy(good.dataset)
    table = pq.read_table(dataset / "index.parquet")
    place, count = table.column_names.index(column), len(table)
    kind = table.schema.field(column).type if value is None else None
    table = table.set_column(place, column, pa.array([value] * count, kind))
    pq.write_table(table, dataset / "index.parquet")
    words = ["data", command, dataset]
    if command == "prepare":
        words += ["--out", tmp_path / "o"]
    answer = answer_of(words, dataset)
    assert_one_clear_error(answer, names=dataset / "index.parquet", says=says)
    assert not (tmp_path / "precious.topo.json").exists()


@pytest.mark.parametrize("spoil", SPOILERS)
@pytest.mark.parametrize("name", ["results.json", "run.json"])
def test_files_of_results(
    good: GoodFiles, copy: Copy, tmp_path: Path, name: str, spoil: Spoil
) -> None:
    results = copy(good.results)
    spoil(results / name)
    answer = answer_of(["tables", results, "--out", tmp_path / "o"], tmp_path)
    assert_one_clear_error(answer, names=results / name)


@pytest.mark.parametrize("content", ["{}", '{"suite": "graphnav", "agents": {"gtl": {"a": 1}}}'])
def test_results_of_something_else(
    good: GoodFiles, copy: Copy, tmp_path: Path, content: str
) -> None:
    results = copy(good.results)
    (results / "results.json").write_text(content)
    answer = answer_of(["tables", results], tmp_path)
    assert_one_clear_error(answer, names=results / "results.json", says="GraphNav suite")


def test_broken_episodes_are_run_again(good: GoodFiles, copy: Copy, tmp_path: Path) -> None:
    results = copy(good.results)
    (episode,) = (results / "episodes").rglob("*.parquet")
    cut(episode)
    source = ["--scene", good.building, "--map", good.map, "--episodes", 1]
    words = ["eval", "graphnav", "--agent", "expert", "--out", results, *source]
    assert answer_of(words, tmp_path).status == 0
    shutil.rmtree(results)
