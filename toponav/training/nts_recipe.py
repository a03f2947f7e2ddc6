"""From a folder of panoramas to the weights of Neural Topological SLAM."""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch

from toponav.data.nts.labels import labels_of, score_of
from toponav.data.nts.panoramas import HomePanoramas, open_panoramas
from toponav.models.nts.network import NTSNetwork
from toponav.models.nts.panorama import network_input, obstacle_profile, sight_profile
from toponav.models.nts.presets import NTSConfig
from toponav.training.config import TrainingConfig
from toponav.training.loop import Report, TrainingResult, train
from toponav.training.nts_task import HomeSamples, NTSTask
from toponav.training.recipes import run_metadata, write_run

__all__ = ["PanoramaSamples", "open_samples", "train_nts"]


@dataclass(frozen=True, eq=False)
class PanoramaSamples:
    """All that the network learns from, in memory: 30 kB a panorama of the compact preset.

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
        config: Sizes of the network; depth is kept for both kinds.
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
    """One home's panoramas and labels."""
    count = len(home)
    images = np.empty((count, 4, config.rows, config.cols), np.uint8)
    obstacle_m = np.empty((count, config.ranges), np.float32)
    sight_m = np.empty((count, config.ranges), np.float32)
    # Read at once: random reads of a mapped file are slow.
    rgb, depth_mm = np.array(home.rgb), np.array(home.depth_mm)
    for k in range(count):
        depth_m = depth_mm[k] / np.float32(1000.0)
        images[k] = network_input(rgb[k], depth_m, config)
        obstacle_m[k] = obstacle_profile(depth_m, config.ranges)
        sight_m[k] = sight_profile(depth_m, config.ranges)
    labels = labels_of(home)
    return HomeSamples(
        images,
        obstacle_m,
        sight_m,
        home.poses,
        labels.same_node,
        labels.explorable,
        score_of(labels.via_m).astype(np.float16),
    )


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
