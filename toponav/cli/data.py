"""`toponav data`: look at datasets, check them, label them, prepare them for training."""

import json as json_module
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from toponav.cli._import_bag import import_bag_
from toponav.cli.progress_bar import progress

__all__ = [
    "annotate_data",
    "data_info",
    "export_data",
    "prepare_data",
    "print_statistics",
    "register",
    "repair_data",
    "verify_data",
]

_Flag = Annotated[bool, tyro.conf.FlagCreatePairsOff]
_Dataset = Annotated[Path, tyro.conf.Positional]


def register() -> dict[tuple[str, ...], Callable[..., Any]]:
    """The commands of this module."""
    return {
        ("data", "info"): data_info,
        ("data", "verify"): verify_data,
        ("data", "repair"): repair_data,
        ("data", "annotate"): annotate_data,
        ("data", "prepare"): prepare_data,
        ("data", "export"): export_data,
        ("data", "import-bag"): import_bag_,
    }


def data_info(dataset: _Dataset, *, card: Path | None = None, json: _Flag = False) -> int:
    """Show what a dataset holds: counts by outcome, building and behaviour.

    Example: toponav data info data/train

    As a page with histograms, to go with the data: toponav data info data/train
    --card data/train-card.md

    Args:
        dataset: Folder of the dataset.
        card: Write a data card to this Markdown file, with its pictures beside it.
        json: Print as JSON.
    """
    from toponav.data.statistics import dataset_statistics

    if card is not None:
        from toponav.data.card import write_card

        written = write_card(dataset, card)
        if not json:
            print(*written, sep="\n")
            return 0
    statistics = dataset_statistics(dataset)
    if json:
        print(json_module.dumps(statistics))
    else:
        print_statistics(statistics, dataset)
    return 0


def print_statistics(statistics: Mapping[str, Any], dataset: Path) -> None:
    """Print a dataset's statistics for a person to read."""
    from rich.console import Console
    from rich.table import Table

    console = Console()
    if not statistics["complete"]:
        console.print(
            f"{dataset}: unfinished, {statistics['episodes']} trajectories were asked for; "
            "run the same `toponav collect` again",
            markup=False,
        )
        return
    outcomes = ", ".join(f"{count} {name}" for name, count in statistics["outcomes"].items())
    console.print(
        f"{dataset}: {statistics['trajectories']} trajectories ({outcomes}), "
        f"{statistics['frames']:,} frames, {statistics['hours']:.2f} h, "
        f"{statistics['distance_m'] / 1000:.2f} km, {statistics['bytes'] / 1e6:.1f} MB, "
        f"{len(statistics['buildings'])} buildings",
        highlight=False,
        markup=False,
    )
    labels = statistics.get("labels")
    if not labels:
        return
    table = Table("behaviour", "by plan", "by the paper's heuristic")
    for name, count in labels["edge_behavior"].items():
        table.add_row(name, f"{count:,}", f"{labels['behavior'][name]:,}")
    console.print(table)


def verify_data(dataset: _Dataset, *, workers: int = 1, json: _Flag = False) -> int:
    """Check every file of a dataset: missing, cut or altered ones are named; exit status 1.

    Example: toponav data verify data/train --workers 4

    Args:
        dataset: Folder of the dataset.
        workers: Processes.
        json: Print the faults as JSON.
    """
    from toponav.data.verify import verify_dataset

    with progress("verifying") as update:
        faults = verify_dataset(dataset, workers=workers, on_progress=update)
    if json:
        found = [{"file": fault.file, "problem": fault.problem} for fault in faults]
        print(json_module.dumps({"faults": found}))
    else:
        for fault in faults:
            print(f"{dataset / fault.file}: {fault.problem}")
        print(
            f"{len(faults)} faults; `toponav data repair {dataset}` puts them right"
            if faults
            else f"{dataset}: every file is as it was recorded"
        )
    return 1 if faults else 0


def repair_data(
    dataset: _Dataset, *, drop: _Flag = False, workers: int = 1, json: _Flag = False
) -> int:
    """Record bad trajectories again, or drop them; then index and label anew.

    Example: toponav data repair data/train --workers 4

    Args:
        dataset: Folder of the dataset.
        drop: Take bad trajectories out instead of recording them again.
        workers: Processes.
        json: Print what was wrong as JSON.
    """
    from toponav.data.verify import repair_dataset

    with progress("repairing") as update:
        faults, manifest = repair_dataset(
            dataset, drop=drop, workers=workers, on_progress=lambda done: update(done, None)
        )
    if json:
        found = [{"file": fault.file, "problem": fault.problem} for fault in faults]
        print(json_module.dumps({"repaired": found, "dropped": list(manifest.dropped)}))
    else:
        for fault in faults:
            print(f"{dataset / fault.file}: {fault.problem}")
        print(f"{len(faults)} faults put right; {len(manifest.trajectories)} trajectories")
    return 0


def annotate_data(dataset: _Dataset, *, workers: int = 1, json: _Flag = False) -> int:
    """Label every frame with room, node, edge and behaviour: annotations.parquet.

    Example: toponav data annotate data/train --workers 4

    Args:
        dataset: Folder of the dataset.
        workers: Processes.
        json: Print the count as JSON.
    """
    from toponav.data.annotations import annotate_dataset

    with progress("annotating") as update:
        frames = annotate_dataset(
            dataset, workers=workers, on_progress=lambda done: update(done, None)
        )
    print(json_module.dumps({"frames": frames}) if json else f"{frames:,} frames labelled")
    return 0


def prepare_data(
    dataset: _Dataset,
    *,
    out: Path,
    preset: Literal["compact", "paper", "best"] = "compact",
    workers: int = 1,
    json: _Flag = False,
) -> int:
    """Resample the depth images to what a preset sees: a cache that training maps into memory.

    Example: toponav data prepare data/train --preset compact --out data/train-compact

    Args:
        dataset: Folder of the dataset.
        out: Folder of the cache.
        preset: Whose image to make.
        workers: Processes.
        json: Print the size as JSON.
    """
    from toponav.data.prepare import prepare

    with progress("preparing") as update:
        made = prepare(dataset, out, preset, workers=workers, on_progress=update)
    size = {"frames": len(made), "rows": made.frames.shape[1], "cols": made.frames.shape[2]}
    text = f"{out}: {size['frames']:,} frames of {size['rows']}x{size['cols']} pixels"
    print(json_module.dumps(size) if json else text)
    return 0


def export_data(
    dataset: _Dataset,
    *,
    out: Path,
    format: Literal["npz"] = "npz",
    workers: int = 1,
    json: _Flag = False,
) -> int:
    """Write the trajectories in another format: NumPy archives that load without pickle.

    The bags themselves already open in ROS 2 tools, Foxglove and `rosbags`.

    Example: toponav data export data/train --out data/train-npz

    Args:
        dataset: Folder of the dataset.
        out: Folder to write to.
        format: Only npz so far, one archive a trajectory.
        workers: Processes.
        json: Print the count as JSON.
    """
    from toponav.data.export import export_npz

    with progress("exporting") as update:
        count = export_npz(dataset, out, workers=workers, on_progress=update)
    print(json_module.dumps({"trajectories": count}) if json else f"{out}: {count} archives")
    return 0
