"""Wrong flags and wrong paths: what the user reads, the exit status, and nothing written."""

import errno
import os
from pathlib import Path

import pytest

from tests.data.small_office import save_building
from tests.hostile import answer_of, assert_one_clear_error
from tests.worlds.test_stanford import write_area

SNAPSHOTS = Path(__file__).parent / "snapshots"
EVAL = "eval graphnav --agent expert --scene {b} --map {m} --out {t}/o"
COLLECT = "collect graphnav --out {t}/o --episodes 1 --buildings {b}"
TRAIN = "train behaviors --data {t} --out {t}/o"


@pytest.fixture(scope="module")
def building(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return save_building(tmp_path_factory.mktemp("cli"))


def _words(line: str, building: Path, tmp_path: Path) -> list[str]:
    places = {"b": building, "m": building / "map.topo.json", "t": tmp_path}
    return [word.format(**places) for word in line.split()]


FAILS = [
    # what is not there
    ("scene import {t}/none.yaml --out {t}/o", r"none\.yaml: cannot be read: no such file"),
    ("scene show {t}/none --out {t}/o.png", r"none/scene\.json: cannot be read: no such file"),
    ("map check {t}/none.topo.json", r"none\.topo\.json: cannot be read: no such file"),
    ("map check {m} --scene {t}/none", r"none/scene\.json: cannot be read"),
    ("map build {t}/none --out {t}/o.topo.json", r"none/scene\.json: cannot be read"),
    ("map plan {m} office_1 ofice_2", "did you mean 'office_2'"),
    ("data info {t}/none", r"none: a dataset is a folder with dataset\.json"),
    ("data verify {b}", r"a dataset is a folder with dataset\.json"),
    ("data repair {m}", r"map\.topo\.json: a dataset is a folder"),
    ("data annotate {t}", r"a dataset is a folder with dataset\.json"),
    ("data prepare {t} --out {t}/o", r"a dataset is a folder with dataset\.json"),
    ("data export {t} --out {t}/o", r"a dataset is a folder with dataset\.json"),
    ("train localization --data {t}/none --out {t}/o", r"none: there is no such folder"),
    ("train all --data {b} --out {t}/o", r"training cache holds cache\.json"),
    ("tables {t}/none", r"none/results\.json: cannot be read: no such file"),
    (EVAL + " --map {t}/none", "none: cannot be read: no such file"),
    (EVAL + " --agent graphnav --weights {t}/none", "there are no weights '.*none'"),
    ("demo --out {t}/o --weights {t}/none", "there are no weights '.*none'"),
    ("collect dagger --out {t}/o --episodes 1 --weights none", "there are no weights 'none'"),
    (COLLECT + " --buildings offices-tran", "did you mean 'offices-train'"),
    (COLLECT + " --buildings {m}", "neither a suite of offices nor|neither an area's yaml"),
    # names mistyped
    (EVAL + " --agent grahpnav", "did you mean 'graphnav'"),
    (EVAL + " --agent os:nothing", "'os:nothing' cannot be imported"),
    (EVAL + " --agent os:sep", "'os:sep' is not callable"),
    (EVAL + " --agent .relative:name", "cannot be imported"),
    (EVAL + " --agent :", "cannot be imported"),
    ("eval graphnav --scene {b} --map {m} --out {t}/o", "at least one agent is needed"),
    ("eval graphnav --agent gtl --out {t}/o", "an area with pairs, or a scene with its map"),
    ("demo --out {t}/o --agent grahpnav", "did you mean 'graphnav'"),
    ("bench --out {t}/o --agent expret", "did you mean 'expert'"),
    # numbers out of range
    (EVAL + " --episodes 0", "--episodes: episodes must be at least 1, got 0"),
    (EVAL + " --episodes -1", "--episodes: episodes must be at least 1, got -1"),
    (EVAL + " --workers 0", "--workers: workers must be 1 to"),
    (EVAL + " --workers -1", "--workers: workers must be 1 to"),
    (EVAL + " --workers 100000", "--workers: workers must be 1 to"),
    (COLLECT + " --workers 0", "--workers: workers must be 1 to"),
    (COLLECT + " --workers 100000", "--workers: workers must be 1 to"),
    (COLLECT + " --episodes 0", "--episodes: episodes must be at least 1, got 0"),
    (COLLECT + " --episodes 1000000000000", "episodes must be at most 10,000,000"),
    (COLLECT + " --seed -1", "--seed: the seed must not be negative"),
    (COLLECT + " --noise-scale nan", "--noise-scale: noise_scale is out of range, got nan"),
    (COLLECT + " --any-yaw-fraction 2", "--any-yaw-fraction: a fraction must lie in 0..1"),
    (COLLECT + " --width 0", "width is out of range, got 0"),
    (COLLECT + " --height 9999999", "height is out of range"),
    (TRAIN + " --epochs 0", "--epochs: epochs is out of range, got 0"),
    (TRAIN + " --learning-rate nan", "--learning-rate: learning_rate is out of range, got nan"),
    (TRAIN + " --threads 0", "--threads: threads is out of range, got 0"),
    (TRAIN + " --max-minutes -1", "--max-minutes: max_minutes is out of range"),
    ("demo --out {t}/o --plans 0", "--plans: plans must be 1 to 20, got 0"),
    ("demo --out {t}/o --building 999", "--building: .* got number 999"),
    ("scene generate office --out {t}/o --seed -1", "--seed: seed must not be negative"),
    ("scene show {b} --views 99 --out {t}/o.png", "--views: views must lie in 0..24"),
    ("map show {m} --start office_1 --out {t}/o.png", "--start, --goal: a plan has a start"),
    ("map show {m} --out {t}/o.docx", "--out: the image must be PNG"),
    ("map convert {m} {t}/o.docx", "the ending of 'o.docx' tells no map format"),
    ("map convert {m} {t}/o.json --to lfi", "--to: must be one of .*did you mean 'lif'"),
    ("map convert {m} {t}/o.json --from lif", "--from: must be one of .*got 'lif'"),
    ("map convert {m} {t}/o.json --level L1", "--level L1: levels are those of Open-RMF"),
    # where results cannot go
    ("scene generate office --out {m}", r"--out .*map\.topo\.json: must be a folder"),
    ("scene generate office --out {t}/full --size small", "holds files but no scene"),
    (
        "scene import {t}/area_0.yaml --out {m}/x",
        r"--out .*/x: must be a folder, but .* is a file",
    ),
    ("scene show {b} --out {t}/full.png", r"--out .*full\.png: must be a file, but is a folder"),
    ("map show {m} --out {m}/o.png", r"must be a folder, but .*map\.topo\.json is a file"),
    ("map convert {m} {t}/full.topo.json", "must be a file, but is a folder"),
    (COLLECT + " --out {m}", r"--out .*map\.topo\.json: must be a folder"),
    (EVAL + " --out {m}", r"--out .*map\.topo\.json: must be a folder"),
    ("tables {t}/none --out {m}", r"--out .*map\.topo\.json: must be a folder"),
    ("demo --out {m}", r"--out .*map\.topo\.json: must be a folder"),
    ("bench --out {m}/x", r"--out .*/x: must be a folder, but .* is a file"),
    ("scene generate office --size small --out /proc/none/x", "/proc/none/x: cannot be written"),
]


@pytest.mark.parametrize(("line", "says"), FAILS)
def test_a_mistake_is_one_clear_error(
    line: str, says: str, building: Path, tmp_path: Path
) -> None:
    for name in ("full", "full.png", "full.topo.json"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "thesis.tex").write_text("years of work")
    write_area(tmp_path)
    answer = answer_of(_words(line, building, tmp_path), tmp_path)
    assert_one_clear_error(answer, says=says)
    assert (building / "map.topo.json").is_file()


@pytest.mark.parametrize(
    "line",
    [
        "",
        "scnee",
        "scene",
        "scene shaw",
        "scene show",
        "scene show {b} --veiws 3",
        "scene generate office --out {t}/o --seed x",
        "scene generate office --out {t}/o --size hug",
        "map plan {m} office_1",
        "collect graphnav --out {t}/o",
        "collect graphnav --out {t}/o --episodes many",
        "data prepare {t} --out {t}/o --preset big",
        "train behaviors --data {t} --out {t}/o --behavior turn_lft",
        "eval graphnav --collisions maybe",
        "tables {t} --format html",
        "bench --only x",
        "demo --plan 3",
    ],
)
def test_wrong_usage_has_status_2_and_writes_nothing(
    line: str, building: Path, tmp_path: Path
) -> None:
    answer = answer_of(_words(line, building, tmp_path), tmp_path)
    assert answer.status == 2, answer
    assert answer.changed == ()
    assert "Traceback" not in answer.err
    assert answer.err or answer.out


@pytest.mark.parametrize(
    ("line", "old"),
    [
        ("map convert {m} {t}/kept", "kept.topo.json"),
        ("map show {m} --out {t}/kept", "kept.png"),
        ("scene show {b} --views 0 --out {t}/kept", "kept.svg"),
    ],
)
def test_a_full_disk_leaves_the_old_file(
    line: str, old: str, building: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(descriptor: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("os.fsync", full)
    (tmp_path / old).write_text("old")
    answer = answer_of(_words(line.replace("kept", old), building, tmp_path), tmp_path)
    assert_one_clear_error(answer, names=tmp_path / old, says="No space left .* free some space")
    assert (tmp_path / old).read_text() == "old"


def test_too_little_memory_is_said_so(
    building: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def greedy(*_: object) -> None:
        raise MemoryError

    monkeypatch.setattr("toponav.worlds.storage.load_scene", greedy)
    answer = answer_of(["scene", "show", building, "--out", tmp_path / "o.png"], tmp_path)
    assert_one_clear_error(answer, says="there is not enough memory for this")


def test_names_in_files_cannot_steer_the_terminal(
    building: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "a\x1b[2Jb.topo.json"
    path.write_text("{")
    answer = answer_of(["map", "check", path], tmp_path)
    assert "\x1b" not in answer.err
    assert r"a\x1b[2Jb.topo.json" in answer.err


MESSAGES = {
    "missing_yaml": "scene import {t}/none.yaml --out {t}/o",
    "mistyped_command": "scene shaw",
    "mistyped_node": "map plan {m} office_1 ofice_2",
    "mistyped_agent": EVAL + " --agent grahpnav",
    "no_such_weights": EVAL + " --agent graphnav --weights {t}/none",
    "no_dataset": "data verify {t}",
    "no_cache": "train all --data {b} --out {t}/o",
    "out_is_a_file": COLLECT + " --out {m}",
    "no_episodes": COLLECT + " --episodes 0",
    "broken_map": "map plan {t}/broken.topo.json a b",
}


@pytest.mark.parametrize("name", MESSAGES)
def test_messages_are_as_agreed(name: str, building: Path, tmp_path: Path) -> None:
    """Set TOPONAV_UPDATE_SNAPSHOTS=1 to store what is said now, and read the difference."""
    (tmp_path / "broken.topo.json").write_text('{"version": 1,\n "nodes": [,]}')
    answer = answer_of(_words(MESSAGES[name], building, tmp_path), tmp_path)
    said = answer.err.replace(str(building), "BUILDING").replace(str(tmp_path), "FOLDER")
    said = said.lstrip("\n")  # the line on which a progress bar was
    stored = SNAPSHOTS / f"{name}.txt"
    if os.environ.get("TOPONAV_UPDATE_SNAPSHOTS"):
        SNAPSHOTS.mkdir(exist_ok=True)
        stored.write_text(said)
    assert said == stored.read_text()
