from pathlib import Path

import pytest

from tests.data.conftest import EPISODES
from toponav.core.errors import InputError
from toponav.data.dataset import read_manifest, recorded, trajectory_path
from toponav.data.verify import repair_dataset, verify_dataset


def flip(path: Path, at: int) -> None:
    content = bytearray(path.read_bytes())
    content[at] ^= 0x01
    path.write_bytes(content)


def test_a_finished_dataset_has_no_faults(finished: Path) -> None:
    assert verify_dataset(finished) == []


def test_a_flipped_byte_is_found_by_name(dataset: Path) -> None:
    flip(trajectory_path(dataset, 2), 20_000)
    (fault,) = verify_dataset(dataset)
    assert fault.file == "trajectories/000002.mcap"
    assert "SHA-256" in fault.problem
    assert "must be whole" in fault.problem


def test_a_cut_file_is_found_by_name(dataset: Path) -> None:
    path = trajectory_path(dataset, 1)
    size = path.stat().st_size
    path.write_bytes(path.read_bytes()[: size // 2])
    (fault,) = verify_dataset(dataset)
    assert fault.file == "trajectories/000001.mcap"
    assert fault.problem == f"is cut: {size // 2} of {size} bytes"


def test_missing_added_and_altered_files_are_found_by_name(dataset: Path) -> None:
    trajectory_path(dataset, 0).unlink()
    trajectory_path(dataset, 90).write_bytes(trajectory_path(dataset, 1).read_bytes())
    flip(dataset / "buildings/small_office/map.topo.json", 30)
    (dataset / "annotations.parquet").write_bytes(b"PAR1")
    found = {fault.file: fault.problem for fault in verify_dataset(dataset)}
    assert found.keys() == {
        "trajectories/000000.mcap",
        "trajectories/000090.mcap",
        "buildings/small_office/map.topo.json",
        "annotations.parquet",
    }
    assert found["trajectories/000000.mcap"] == "is missing"
    assert found["trajectories/000090.mcap"] == "is not in the manifest"


def test_repair_records_bad_trajectories_again_byte_for_byte(dataset: Path) -> None:
    before = read_manifest(dataset)
    flip(trajectory_path(dataset, 2), 5_000)
    trajectory_path(dataset, 0).write_bytes(b"")
    (dataset / "buildings/small_office/map.topo.json").unlink()
    faults, after = repair_dataset(dataset)
    assert len(faults) == 3
    assert after.trajectories == before.trajectories
    assert after.buildings == before.buildings
    assert verify_dataset(dataset) == []


def test_repair_can_drop_instead(dataset: Path) -> None:
    flip(trajectory_path(dataset, 2), 5_000)
    _, manifest = repair_dataset(dataset, drop=True)
    assert manifest.dropped == (2,)
    assert recorded(dataset) == [index for index in range(EPISODES) if index != 2]
    assert verify_dataset(dataset) == []


def test_what_is_no_dataset_is_said_so(tmp_path: Path, dataset: Path) -> None:
    with pytest.raises(InputError, match=r"a dataset is a folder with dataset\.json"):
        verify_dataset(tmp_path)
    (dataset / "dataset.json").write_text('{"schema": 1}')
    with pytest.raises(InputError, match=r"dataset\.json: the manifest lacks or garbles 'kind'"):
        verify_dataset(dataset)
    (dataset / "dataset.json").write_text("[1, 2")
    with pytest.raises(InputError, match="must be JSON"):
        verify_dataset(dataset)
