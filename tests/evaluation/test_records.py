from dataclasses import replace
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from tests.evaluation.records import STEP, record
from toponav.core.errors import InputError
from toponav.evaluation.records import (
    StoredEpisode,
    load_episode,
    save_episode,
    write_atomically,
    write_episode_table,
    write_step_table,
)


def test_an_episode_comes_back_as_it_was_saved(tmp_path: Path) -> None:
    astray = replace(STEP, true_node=None, true_edge=None, true_behavior=None, behavior=None)
    stored = StoredEpisode(record(steps=(STEP, astray)), "key", "commit")
    save_episode(tmp_path / "deep" / "0.parquet", stored)
    assert load_episode(tmp_path / "deep" / "0.parquet") == stored


@pytest.mark.parametrize("kept", [0, 1, 100, -100, -1])
def test_an_episode_cut_short_counts_as_absent(tmp_path: Path, kept: int) -> None:
    path = tmp_path / "0.parquet"
    save_episode(path, StoredEpisode(record(), "key"))
    path.write_bytes(path.read_bytes()[:kept])
    assert load_episode(path) is None


def test_a_table_of_another_kind_counts_as_absent(tmp_path: Path) -> None:
    write_episode_table(tmp_path / "episodes.parquet", [record()])
    assert load_episode(tmp_path / "episodes.parquet") is None
    assert load_episode(tmp_path / "nothing.parquet") is None


def test_tables_have_a_row_per_episode_and_per_step(tmp_path: Path) -> None:
    records = [record("gtl", 0), record("gtl", 7)]
    write_episode_table(tmp_path / "episodes.parquet", records)
    write_step_table(tmp_path / "steps.parquet", records)
    episodes = pq.read_table(tmp_path / "episodes.parquet").to_pylist()
    assert [row["episode"] for row in episodes] == [0, 7]
    assert episodes[0]["strict_outcome"] == "success"
    assert episodes[0]["driven_m"] == pytest.approx(0.125)
    steps = pq.read_table(tmp_path / "steps.parquet").to_pylist()
    assert [(row["agent"], row["episode"]) for row in steps] == [("gtl", 0)] * 2 + [("gtl", 7)] * 2


def test_a_failed_write_leaves_the_old_content_and_no_litter(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_atomically(tmp_path / "a.txt", "old")

    def fail(*_: object) -> None:
        raise OSError("disk full")

    monkeypatch.setattr("os.replace", fail)
    with pytest.raises(InputError, match="disk full"):
        write_atomically(tmp_path / "a.txt", "new")
    assert [path.name for path in tmp_path.iterdir()] == ["a.txt"]
    assert (tmp_path / "a.txt").read_text() == "old"
