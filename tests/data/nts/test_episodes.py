"""Frozen episodes are whole, balanced, reachable and true; Habitat's format keeps them."""

import gzip
import json
import math
from pathlib import Path

import pytest

from toponav.cli.main import main
from toponav.core.errors import InputError
from toponav.core.geometry import Pose2, angle_difference
from toponav.core.imagenav import DIFFICULTIES, DIFFICULTY_M, ImageNavEpisode
from toponav.data.nts.episode_sampling import episode_statistics, sample_episodes
from toponav.data.nts.episodes import (
    FROZEN_COUNTS,
    frozen_file,
    frozen_statistics,
    load_episodes,
    read_episodes,
    write_episodes,
)
from toponav.data.nts.habitat import export_habitat, habitat_episode, import_habitat
from toponav.worlds.generate.suites import frozen_hash, suite, suite_scene


@pytest.mark.parametrize("name", list(FROZEN_COUNTS))
def test_each_difficulty_has_its_episodes_over_all_buildings(name: str) -> None:
    episodes = load_episodes(name)
    assert len({one.id for one in episodes}) == 3 * FROZEN_COUNTS[name]
    seeds = list(suite(name).seeds)
    for difficulty in DIFFICULTIES:
        chosen = [one for one in episodes if one.difficulty == difficulty]
        near_m, far_m = DIFFICULTY_M[difficulty]
        assert len(chosen) == FROZEN_COUNTS[name]
        assert all(near_m <= one.geodesic_m < far_m for one in chosen)
        assert all(one.geodesic_m >= one.start.distance_to(one.goal) - 1e-3 for one in chosen)
        assert [one.scene_seed for one in chosen[: len(seeds)]] == seeds


@pytest.mark.parametrize("name", list(FROZEN_COUNTS))
def test_episodes_are_of_the_frozen_buildings(name: str) -> None:
    document = json.loads(gzip.decompress(frozen_file(name).read_bytes()))
    for seed in suite(name).seeds:
        frozen = frozen_hash("home", seed)
        assert frozen is not None
        assert document["scenes"][str(seed)].startswith(frozen)


@pytest.mark.slow
def test_sampling_again_gives_the_frozen_episodes_of_a_building(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from toponav.data.nts import episode_sampling
    from toponav.worlds.generate.suites import Suite

    one_home = Suite("homes-val", "home", range(1000, 1001))
    monkeypatch.setattr(episode_sampling, "suite", lambda name: one_home)
    found = sample_episodes("homes-val", 1)
    frozen = [one for one in load_episodes("homes-val") if one.number == 0]
    assert found == frozen
    statistics = episode_statistics(found, lambda seed: suite_scene("home", seed))
    assert statistics["hard"]["path_m"] == frozen[2].geodesic_m


def test_some_are_asked_for() -> None:
    assert [one.number for one in load_episodes("homes-val", "hard", 3)] == [0, 1, 2]
    assert len(load_episodes("homes-val", count=2)) == 6


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("homes-tset",), "homes-test"),
        (("homes-val", "hrad"), "hard"),
        (("homes-val", "hard", 101), "100 episodes"),
    ],
)
def test_what_is_not_frozen_is_refused(arguments: tuple[str], message: str) -> None:
    with pytest.raises(InputError, match=message):
        load_episodes(*arguments)


def test_harder_episodes_are_longer_and_cross_more_rooms() -> None:
    statistics = frozen_statistics("homes-test")
    for name in ("path_m", "path_over_straight", "rooms"):
        easy, medium, hard = (statistics[one][name] for one in DIFFICULTIES)
        assert easy < medium < hard


def test_written_episodes_are_read_back_and_changed_ones_refused(tmp_path: Path) -> None:
    episodes = load_episodes("homes-val", count=2)
    path = tmp_path / "few.json.gz"
    first = write_episodes(path, episodes, seed=0, scenes={1000: "00"})
    assert read_episodes(path) == episodes
    assert write_episodes(path, episodes, seed=0, scenes={1000: "00"}) == first
    text = gzip.decompress(path.read_bytes()).decode()
    path.write_bytes(gzip.compress(text.replace("1000,", "1001,", 1).encode()))
    with pytest.raises(InputError, match="changed"):
        read_episodes(path)
    path.write_bytes(b"none")
    with pytest.raises(InputError, match="gzip"):
        read_episodes(path)


@pytest.mark.parametrize("name", ["episodes.json", "episodes.json.gz"])
def test_habitat_s_format_keeps_every_episode(name: str, tmp_path: Path) -> None:
    episodes = load_episodes("homes-val", count=5)
    export_habitat(tmp_path / name, episodes)
    for one, other in zip(episodes, import_habitat(tmp_path / name), strict=True):
        assert other.id == one.id
        assert other.scene_seed == one.scene_seed
        assert other.geodesic_m == one.geodesic_m
        for pose, again in ((one.start, other.start), (one.goal, other.goal)):
            assert again[:2] == pytest.approx(pose[:2])
            assert angle_difference(again.yaw_rad, pose.yaw_rad) == pytest.approx(0, abs=1e-9)


def test_habitat_s_axes_are_y_up_and_look_along_minus_z() -> None:
    north = Pose2(1.0, 2.0, math.pi / 2)
    row = habitat_episode(ImageNavEpisode("homes-val", 1000, north, north, 2.0, "easy"))
    assert row["start_position"] == [1.0, 0.0, -2.0]
    # Our +y is Habitat's -z, where an agent looks that is not turned.
    assert row["start_rotation"] == pytest.approx([0.0, 0.0, 0.0, 1.0])


def test_an_episode_of_another_data_set_keeps_its_scene(tmp_path: Path) -> None:
    path = tmp_path / "gibson.json"
    row = {
        "episode_id": "0",
        "scene_id": "gibson/Cantwell.glb",
        "start_position": [1.0, 0.1, 2.0],
        "start_rotation": [0, 0, 0, 1],
        "info": {"geodesic_distance": 6.3},
        "goals": [{"position": [3.0, 0.1, -2.0]}],
    }
    path.write_text(json.dumps({"episodes": [row]}))
    (episode,) = import_habitat(path)
    assert (episode.scene_suite, episode.difficulty) == ("gibson/Cantwell.glb", "hard")
    assert episode.start == pytest.approx(Pose2(1.0, -2.0, math.pi / 2))


@pytest.mark.parametrize(
    ("document", "message"),
    [
        ([], "no list"),
        ({"episodes": []}, "no list"),
        ({"episodes": [3]}, "must hold"),
        ({"episodes": [{"episode_id": "7"}]}, "episode 7"),
        (
            {
                "episodes": [
                    {
                        "scene_id": "a.glb",
                        "start_position": [0, 0, 0],
                        "start_rotation": [0, 0, 0, 9],
                        "goals": [{"position": [0, 0, 0]}],
                        "info": {"geodesic_distance": 2.0},
                    }
                ]
            },
            "quaternion",
        ),
    ],
)
def test_what_is_no_habitat_file_is_refused(
    document: object, message: str, tmp_path: Path
) -> None:
    path = tmp_path / "bad.json"
    path.write_text(json.dumps(document))
    with pytest.raises(InputError, match=message):
        import_habitat(path)


def test_the_commands_show_export_and_check(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["episodes", "show", "--suite", "homes-val"]) == 0
    assert "medium" in capsys.readouterr().out
    path = str(tmp_path / "out.json.gz")
    assert main(["episodes", "export", "--suite", "homes-val", "--out", path]) == 0
    assert main(["episodes", "check", path]) == 0
    assert "100 easy, 100 medium, 100 hard" in capsys.readouterr().out
    assert main(["episodes", "check", str(tmp_path / "none.json")]) == 1
