"""Image-goal episodes in Habitat's episode JSON, both ways.

Habitat's worlds are y up and its agents look along -z: our (x, y, yaw) is its position (x, 0, -y)
and a turn of yaw - 90 degrees about y. That is also how our `mesh.glb` stands in Habitat.
"""

import gzip
import json
import math
import re
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from toponav.core.errors import InputError
from toponav.core.files import parse_json, read_bytes, write_atomically
from toponav.core.geometry import Pose2, wrap_angle
from toponav.core.imagenav import DIFFICULTIES, DIFFICULTY_M, Difficulty, ImageNavEpisode

__all__ = ["export_habitat", "habitat_episode", "import_habitat"]

_MAX_BYTES = 256 << 20
_REMEDY = "give a Habitat PointNav or ImageNav dataset: {'episodes': [...]}, plain or gzipped"
_SCENE = re.compile(r"(?P<suite>[a-z]+-[a-z]+)-(?P<seed>\d{1,9})(\.\w+)?$")


def habitat_episode(episode: ImageNavEpisode) -> dict[str, Any]:
    """One episode as Habitat-Lab's `NavigationEpisode` reads it.

    The goal's heading goes to `info`, where Habitat leaves it alone: its own image goals face
    a direction drawn from the episode's id.
    """
    return {
        "episode_id": episode.id,
        "scene_id": f"{episode.scene_suite}/{episode.scene_suite}-{episode.scene_seed}.glb",
        "start_position": _position(episode.start),
        "start_rotation": _rotation(episode.start),
        "info": {
            "geodesic_distance": episode.geodesic_m,
            "difficulty": episode.difficulty,
            "goal_rotation": _rotation(episode.goal),
        },
        "goals": [{"position": _position(episode.goal), "radius": None}],
        "shortest_paths": None,
        "start_room": None,
    }


def export_habitat(path: Path, episodes: Sequence[ImageNavEpisode]) -> None:
    """Writes episodes as Habitat JSON, gzipped where the name ends in `.gz`."""
    text = json.dumps({"episodes": [habitat_episode(one) for one in episodes]}) + "\n"
    data = text.encode()
    write_atomically(path, gzip.compress(data, mtime=0) if path.suffix == ".gz" else data)


def import_habitat(path: Path) -> tuple[ImageNavEpisode, ...]:
    """The episodes of a Habitat file of point-goal or image-goal navigation.

    Scenes that are not ours keep their `scene_id` as the suite, with seed 0. Where an episode
    has no goal heading it is 0; heights are dropped, as our buildings have one floor. Episodes
    without a difficulty get that of their geodesic distance; those outside 1.5 to 10 m are
    refused.

    Raises:
        InputError: When the file is no such file, or an episode is broken; its id is told.
    """
    data = read_bytes(path, max_bytes=_MAX_BYTES)
    if data[:2] == b"\x1f\x8b":
        try:
            data = zlib.decompressobj(wbits=31).decompress(data, _MAX_BYTES)
        except zlib.error as error:
            raise InputError(f"not gzip: {error}", where=str(path), remedy=_REMEDY) from None
    document = parse_json(data, str(path))
    rows = document.get("episodes") if isinstance(document, dict) else None
    if not isinstance(rows, list) or not rows:
        raise InputError("holds no list of episodes", where=str(path), remedy=_REMEDY)
    counts: dict[tuple[str, str], int] = {}
    episodes = []
    for place, row in enumerate(rows):
        name = row.get("episode_id", place) if isinstance(row, dict) else place
        where = f"{path}, episode {str(name)[:60]}"
        try:
            suite_name, seed = _scene(str(row["scene_id"]))
            info = row.get("info") or {}
            start = _pose(row["start_position"], row["start_rotation"])
            goal_rotation = info.get("goal_rotation") or _rotation(Pose2(0.0, 0.0, 0.0))
            goal = _pose(row["goals"][0]["position"], goal_rotation)
            geodesic_m = float(info["geodesic_distance"])
            difficulty = _difficulty(info.get("difficulty"), geodesic_m)
        except (KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
            raise InputError(
                f"a Habitat episode must hold scene_id, start_position, start_rotation, goals "
                f"and info.geodesic_distance of 1.5 to 10 m ({type(error).__name__}: {error})",
                where=where,
                remedy=_REMEDY,
            ) from None
        number = counts.get((suite_name, difficulty), 0)
        counts[suite_name, difficulty] = number + 1
        episodes.append(
            ImageNavEpisode(suite_name, seed, start, goal, geodesic_m, difficulty, number)
        )
    return tuple(episodes)


def _scene(scene_id: str) -> tuple[str, int]:
    found = _SCENE.search(scene_id.rsplit("/", 1)[-1])
    if found is None:
        return scene_id, 0
    return found["suite"], int(found["seed"])


def _difficulty(given: Any, geodesic_m: float) -> Difficulty:
    for difficulty in DIFFICULTIES:
        if given == difficulty:
            return difficulty
    for difficulty, (near_m, far_m) in DIFFICULTY_M.items():
        if near_m <= geodesic_m < far_m:
            return difficulty
    raise ValueError(f"its geodesic distance is {geodesic_m} m")


def _position(pose: Pose2) -> list[float]:
    return [pose.x_m, 0.0, -pose.y_m]


def _rotation(pose: Pose2) -> list[float]:
    """Quaternion (x, y, z, w)."""
    half_rad = (pose.yaw_rad - math.pi / 2) / 2
    return [0.0, math.sin(half_rad), 0.0, math.cos(half_rad)]


def _pose(position: Any, rotation: Any) -> Pose2:
    x, _, z = (float(value) for value in position)
    quaternion = np.array([float(value) for value in rotation])
    norm = float(np.linalg.norm(quaternion))
    if quaternion.shape != (4,) or not 0.9 < norm < 1.1:
        raise ValueError(f"a rotation must be a unit quaternion, got {rotation}")
    qx, qy, qz, qw = (quaternion / norm).tolist()
    # Where it looks: -z turned by the quaternion.
    forward_x = -2 * (qx * qz + qw * qy)
    forward_z = -(1 - 2 * (qx * qx + qy * qy))
    yaw_rad = wrap_angle(math.atan2(-forward_z, forward_x))
    return Pose2(x, -z, yaw_rad)
