"""`toponav train nts`: the multi-task network of Neural Topological SLAM."""

from pathlib import Path
from typing import Literal

from toponav.cli._training import print_results, shown
from toponav.models.nts.presets import NTSPresetName, get_nts_preset
from toponav.training.config import default_config

__all__ = ["nts"]


def nts(
    *,
    data: Path,
    out: Path,
    preset: NTSPresetName = "compact",
    modality: Literal["rgb", "rgbd", "both"] = "both",
    epochs: int | None = None,
    batch_size: int | None = None,
    learning_rate: float | None = None,
    seed: int = 0,
    threads: int = 1,
    max_minutes: float | None = None,
    precision: Literal["auto", "float32", "bfloat16"] = "auto",
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
        epochs: Epochs a network; the preset's number when left out.
        batch_size: Panoramas a step; the preset's number when left out.
        learning_rate: Highest learning rate; the preset's when left out.
        seed: Same seed, data and threads, same weights.
        threads: CPU threads to use.
        max_minutes: Train fewer epochs where they would take longer in all.
        precision: Number format; `auto` times both.
        json: Print results as JSON.
    """
    from toponav.training.nts_recipe import open_samples, train_nts

    kinds = {"rgb": (False,), "rgbd": (True,), "both": (True, False)}[modality]
    config = default_config(preset, "nts").with_changes(
        epochs=epochs,
        batch_size=batch_size,
        learning_rate=learning_rate,
        seed=seed,
        threads=threads,
        max_minutes=None if max_minutes is None else max_minutes / len(kinds),
        precision=precision,
    )
    results = []
    with shown(json) as report:
        for depth in kinds:
            sizes = get_nts_preset(preset, depth=depth)
            samples = open_samples(data, sizes)
            results.append(train_nts(samples, sizes, preset, config, out, report=report))
    return print_results(results, out, json)
