import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from tests.data.small_office import save_building
from toponav.cli.main import main


@pytest.fixture(scope="module")
def collected(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("cli")
    building = save_building(folder)
    words = f"collect graphnav --out {folder / 'data'} --episodes 1 --width 80 --height 60"
    assert main([*words.split(), "--buildings", str(building)]) == 0
    return folder / "data"


def test_collect_says_what_it_collected(
    collected: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["data", "info", str(collected)]) == 0
    assert "1 trajectories (1 success)" in " ".join(capsys.readouterr().out.split())
    assert main(["data", "info", str(collected), "--json"]) == 0
    statistics = json.loads(capsys.readouterr().out)
    assert statistics["outcomes"] == {"success": 1}
    labels = statistics["labels"]
    assert sum(labels["edge_behavior"].values()) == statistics["frames"]


def test_a_data_card_says_what_the_dataset_holds(
    collected: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    card = tmp_path / "office.md"
    assert main(["data", "info", str(collected), "--card", str(card)]) == 0
    written = [Path(line) for line in capsys.readouterr().out.split()]
    assert [path.name for path in written] == [
        "office.md", "office_lengths.png", "office_behaviors.png",
    ]  # fmt: skip
    text = card.read_text()
    assert "# Data card: office" in text
    assert "| outcomes | 1 success |" in text
    assert all(f"({path.name})" in text for path in written[1:])
    assert str(tmp_path) not in text
    assert str(collected.parent) not in text
    assert main(["data", "info", str(collected), "--card", str(card), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["trajectories"] == 1


def test_a_card_needs_a_finished_dataset(
    collected: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data = Path(shutil.copytree(collected, tmp_path / "data"))
    manifest = json.loads((data / "dataset.json").read_text())
    (data / "dataset.json").write_text(json.dumps({**manifest, "complete": False}))
    assert main(["data", "info", str(data), "--card", str(tmp_path / "card.md")]) == 1
    assert "a card is of a finished dataset" in capsys.readouterr().err
    assert not (tmp_path / "card.md").exists()


def test_verify_and_repair_answer_with_their_exit_status(
    collected: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data = Path(shutil.copytree(collected, tmp_path / "data"))
    assert main(["data", "verify", str(data)]) == 0
    bag = data / "trajectories" / "000000.mcap"
    bag.write_bytes(bag.read_bytes()[:1000])
    capsys.readouterr()
    assert main(["data", "verify", str(data)]) == 1
    assert f"{bag}: is cut: 1000 of" in capsys.readouterr().out
    assert main(["data", "repair", str(data)]) == 0
    assert main(["data", "verify", str(data), "--json"]) == 0


def test_prepare_annotate_and_export_write_what_they_say(
    collected: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["data", "annotate", str(collected), "--json"]) == 0
    frames = json.loads(capsys.readouterr().out)["frames"]
    assert main(["data", "prepare", str(collected), "--out", str(tmp_path / "c"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"frames": frames, "rows": 32, "cols": 96}
    assert main(["data", "export", str(collected), "--out", str(tmp_path / "npz")]) == 0
    with np.load(tmp_path / "npz" / "000000.npz", allow_pickle=False) as archive:
        assert archive["depth_mm"].shape == (frames, 60, 80)
        assert set(archive["edge_behavior"]) >= {"find_door", "corridor_follow"}


def test_bad_input_is_one_line_on_stderr(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["data", "verify", str(tmp_path)]) == 1
    assert "a dataset is a folder with dataset.json" in capsys.readouterr().err
    words = f"collect graphnav --out {tmp_path / 'x'} --episodes 0"
    assert main(words.split()) == 1
    assert "--episodes: episodes must be at least 1, got 0" in capsys.readouterr().err
