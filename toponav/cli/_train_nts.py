"""`toponav train nts`: the multi-task network of Neural Topological SLAM."""

from pathlib import Path
from typing import Literal

from toponav.cli._training import AS_PRESET, Schedule, print_results, shown
from toponav.models.nts.presets import NTSPresetName, get_nts_preset
from toponav.training.config import default_config

__all__ = ["nts"]


def nts(
    *,
    data: Path,
    out: Path,
    preset: NTSPresetName = "compact",
    modality: Literal["rgb", "rgbd", "both"] = "both",
    schedule: Schedule = AS_PRESET,
    json: bool = False,
) -> int:
    """Train the network that tells nodes, directions and explorable places from panoramas.

    Killed or interrupted, the same command goes on after the last whole epoch.

    Example: toponav train nts --data runs/panoramas --out runs/nts --max-minutes 15

    Args:
        data: Folder that `toponav collect nts` wrote.
        out: Folder for weights, metrics and the state to resume from.
        preset: Sizes of the network.
        modality: Colour, colour and depth, or one network for each.
        schedule: How long and how fast.
        json: Print results as JSON.
    """
    from toponav.training.nts_recipe import open_samples, train_nts

    kinds = {"rgb": (False,), "rgbd": (True,), "both": (True, False)}[modality]
    config = schedule.applied(default_config(preset, "nts"), len(kinds))
    results = []
    with shown(json) as report:
        for depth in kinds:
            sizes = get_nts_preset(preset, depth=depth)
            samples = open_samples(data, sizes)
            results.append(train_nts(samples, sizes, preset, config, out, report=report))
    return print_results(results, out, json)
