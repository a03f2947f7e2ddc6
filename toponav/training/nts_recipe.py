"""From a folder of panoramas to the weights of Neural Topological SLAM."""

import hashlib
import io
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Bool, Float16, Int64

from toponav.core.arrays import map_npy
from toponav.core.files import write_atomically
from toponav.data.nts.labels import labels_of, score_of
from toponav.data.nts.panoramas import HomePanoramas, open_panoramas
from toponav.models.nts.network import NTSNetwork
from toponav.models.nts.panorama import network_input, obstacle_profile, sight_profile
from toponav.models.nts.presets import ROOM_KINDS, NTSConfig
from toponav.training.config import TrainingConfig
from toponav.training.loop import Report, TrainingResult, train
from toponav.training.nts_task import HomeSamples, NTSTask
from toponav.training.recipes import run_metadata, write_run

__all__ = ["PanoramaSamples", "open_samples", "train_nts"]

_VERSION = 1
"""Of the way in which panoramas are made small."""
_MOST_IN_MEMORY = 64 << 20


@dataclass(frozen=True, eq=False)
class PanoramaSamples:
    """All that the network learns from: 30 to 50 kB of memory a panorama of the compact preset.

    Attributes:
        homes: A home each.
        digest: Identifies the data.
        names: Of the homes.
    """

    homes: tuple[HomeSamples, ...]
    digest: str
    names: tuple[str, ...]


def open_samples(
    folder: Path,
    config: NTSConfig,
    *,
    on_progress: Callable[[int, int], None] | None = None,
) -> PanoramaSamples:
    """The panoramas of a folder, made small, with the labels of all pairs of each home.

    Args:
        folder: What `toponav collect nts` wrote; homes that are not complete are left out.
        config: Sizes of the network; depth is kept for all.
        on_progress: Told how many homes are done of how many.

    Raises:
        InputError: There are no panoramas, or they are broken.
    """
    found = open_panoramas(folder, partial=True)
    digest = hashlib.sha256()
    homes = []
    for number, home in enumerate(found):
        homes.append(samples_of_home(home, config))
        digest.update(f"{home.content_hash} {home.config}".encode())
        if on_progress is not None:
            on_progress(number + 1, len(found))
    names = tuple(f"{home.scene_suite}-{home.scene_seed:04d}" for home in found)
    return PanoramaSamples(tuple(homes), digest.hexdigest(), names)


def samples_of_home(home: HomePanoramas, config: NTSConfig) -> HomeSamples:
    """One home's panoramas and labels; made small on first use and kept beside the originals."""
    labels = labels_of(home)
    rows, cols = home.ground.cells_of(home.poses[:, :2]).T
    numbers = {str(kind): number for number, kind in enumerate(ROOM_KINDS)}
    room_kinds = np.array([*(numbers.get(kind, -1) for kind in home.rooms), -1])
    kind = room_kinds[home.ground.room_index[rows, cols]].astype(np.int64)
    score = score_of(labels.via_m).astype(np.float16)
    small = _small(home, config)
    return HomeSamples(
        poses=home.poses,
        same_node=labels.same_node,
        explorable=labels.explorable,
        score=score,
        kind=kind,
        toward=_toward(score, labels.same_node, kind),
        **small,
    )


def _toward(
    score: Float16[np.ndarray, "places places directions"],
    same_node: Bool[np.ndarray, "places places"],
    kind: Int64[np.ndarray, " places"],
) -> Float16[np.ndarray, "places kinds directions"]:
    """Score of the best goal of each kind of room in another node; -1 where there is none."""
    toward = np.full((len(score), len(ROOM_KINDS), score.shape[2]), -1.0, np.float16)
    for number in range(len(ROOM_KINDS)):
        goals = np.flatnonzero(kind == number)
        if len(goals):
            other = ~same_node[:, goals, None]
            toward[:, number] = np.where(other, score[:, goals], np.float16(-1.0)).max(axis=1)
    return toward


def _small(home: HomePanoramas, config: NTSConfig) -> dict[str, np.ndarray]:
    """Panoramas as the network sees them, mapped from the disk where they are large."""
    shape = (len(home), 4, config.rows, config.cols)
    profile = (len(home), config.ranges)
    wanted = {
        "images": ("uint8", shape),
        "obstacle_m": ("float32", profile),
        "sight_m": ("float32", profile),
    }
    name = f"small-{_VERSION}-{len(home)}-{config.rows}x{config.cols}-{config.ranges}"
    paths = {key: home.folder / f"{name}-{key}.npy" for key in wanted}
    if not all(path.exists() for path in paths.values()):
        for key, made in _made_small(home, config, shape, profile).items():
            content = io.BytesIO()
            np.save(content, made)
            write_atomically(paths[key], content.getvalue())
    found = {}
    for key, (dtype, size) in wanted.items():
        mapped = map_npy(paths[key], dtype, size, remedy="delete the file: it is made again")
        found[key] = np.array(mapped) if mapped.nbytes < _MOST_IN_MEMORY else mapped
    return found


def _made_small(
    home: HomePanoramas, config: NTSConfig, shape: tuple[int, ...], profile: tuple[int, int]
) -> dict[str, np.ndarray]:
    images = np.empty(shape, np.uint8)
    obstacle_m, sight_m = np.empty(profile, np.float32), np.empty(profile, np.float32)
    with_depth = replace(config, depth=True)
    # Read at once: random reads of a mapped file are slow.
    rgb, depth_mm = np.array(home.rgb), np.array(home.depth_mm)
    for k in range(len(home)):
        depth_m = depth_mm[k] / np.float32(1000.0)
        images[k] = network_input(rgb[k], depth_m, with_depth)
        obstacle_m[k] = obstacle_profile(depth_m, config.ranges)
        sight_m[k] = sight_profile(depth_m, config.ranges)
    return {"images": images, "obstacle_m": obstacle_m, "sight_m": sight_m}


def train_nts(
    samples: PanoramaSamples,
    sizes: NTSConfig,
    preset: str,
    config: TrainingConfig,
    out: Path,
    *,
    report: Report | None = None,
) -> TrainingResult:
    """Train one network: `out/nts_rgbd.safetensors` or `out/nts_rgb.safetensors`.

    Args:
        samples: Panoramas and labels.
        sizes: Sizes of the network, and whether it sees depth.
        preset: Name of the sizes.
        config: How to train.
        out: Folder for the weights.
        report: Told about progress.

    Raises:
        InputError: The folder holds another run.
    """
    torch.manual_seed(config.seed)
    task = NTSTask(NTSNetwork(sizes), samples.homes, config)
    metadata = run_metadata(preset, samples.digest, ())
    metadata["panoramas"] = sum(map(len, samples.homes))
    metadata["homes"] = list(samples.names)
    write_run(out, task.name, config, metadata)
    return train(task, config, out, data_hash=samples.digest, metadata=metadata, report=report)
