"""`toponav collect imitation`: drives of the shortest-path expert, as compact panoramas."""

import json as json_module
from pathlib import Path
from typing import Annotated, Literal

import tyro

from toponav.models.baselines.image_goal_presets import ImageGoalPresetName

__all__ = ["collect_imitation"]


def collect_imitation(
    *,
    out: Path,
    suite: Literal["homes-train", "homes-val"] = "homes-train",
    homes: int | None = None,
    episodes: int = 24,
    preset: ImageGoalPresetName = "compact",
    modality: Literal["rgb", "rgbd"] = "rgbd",
    homes_folder: Path | None = None,
    learner: str | None = None,
    learner_name: str | None = None,
    expert_share: float = 0.3,
    seed: int = 0,
    workers: int = 1,
    engine: Literal["local", "ray"] = "local",
    json: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False,
) -> int:
    """Collect drives along shortest paths, with what the expert does at each step.

    Example: toponav collect imitation --out runs/drives --episodes 24 --workers 8

    With `--learner`, policy and expert take turns at the wheel, and the expert says what it would
    have done (DAgger). Interrupt it whenever you like: the same command resumes with the next
    home, and the data do not depend on the number of workers.

    Args:
        out: Folder of the drives.
        suite: Suite of homes.
        homes: How many of them, from the first; all when left out.
        episodes: Drives in each home.
        preset: Whose panoramas: those of the network to be trained.
        modality: Colour, or colour and depth. Compact networks of one modality do not learn from
            drives of the other, whose panoramas have another size.
        homes_folder: Keep the homes here, so that another run need not make them again.
        learner: Folder of weights that drive beside the expert.
        learner_name: Which policy of that folder; that of imitation when left out.
        expert_share: Share of the time that the expert drives beside a learner.
        seed: Seed of the drives; give every round of DAgger its own.
        workers: Processes.
        engine: Where they run: on this machine, or on a Ray cluster.
        json: Print what was collected as JSON.
    """
    from toponav.cli.progress_bar import progress
    from toponav.training.image_goals.demonstrations import (
        DemonstrationConfig,
        collect_demonstrations,
    )
    from toponav.worlds.generate.suites import suite as suite_named

    count = len(suite_named(suite).seeds) if homes is None else homes
    config = DemonstrationConfig(
        suite=suite,
        homes=count,
        episodes=episodes,
        preset=preset,
        depth=modality == "rgbd",
        seed=seed,
        learner=learner,
        learner_name=learner_name or f"il_{modality}",
        expert_share=expert_share,
    )
    with progress("homes") as update:
        collected = collect_demonstrations(
            out,
            config,
            workers=workers,
            engine=engine,
            homes_folder=homes_folder,
            on_progress=lambda done: update(done, count),
        )
    found = {
        "homes": len(collected),
        "drives": sum(len(home.goal) for home in collected),
        "reached": sum(home.reached for home in collected),
        "frames": sum(len(home.action) for home in collected),
    }
    if json:
        print(json_module.dumps(found))
    else:
        print(
            f"{found['frames']:,} frames of {found['drives']:,} drives in {found['homes']} homes, "
            f"{found['reached']:,} of them to their goal: {out}"
        )
    return 0
