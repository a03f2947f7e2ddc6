"""Writes docs/results.md: the tables of both papers from the stored runs, and what was trained.

    python benchmarks/results_page.py                      the page
    python benchmarks/results_page.py curves FOLDER ...    training curves of GraphNav's networks

Nothing on the page is typed in: it is laid out from benchmarks/results and from the files beside
the weights that ship, and a test compares it with them. `curves` stores the metrics.jsonl of
training runs (`FOLDER/<network>/metrics.jsonl`, or NAME=FOLDER for another name) as
benchmarks/results/graphnav_curves.json and draws docs/images/graphnav-training.png.
"""

import io
import json
import sys
from pathlib import Path
from typing import Any

from toponav.core.errors import InputError
from toponav.core.files import read_json, write_atomically
from toponav.evaluation.analysis_tables import failures_table, rules_table
from toponav.evaluation.imagenav.tables import IMAGE_NAV_TABLES, load_image_nav_results
from toponav.evaluation.table_layout import PaperTable, to_markdown
from toponav.evaluation.tables import (
    load_results,
    localization_table,
    prediction_table,
    success_table,
)

ROOT = Path(__file__).parent.parent
RESULTS = ROOT / "benchmarks" / "results"
PAGE = ROOT / "docs" / "results.md"
PICTURE = ROOT / "docs" / "images" / "graphnav-training.png"
CURVES = RESULTS / "graphnav_curves.json"
WEIGHTS = ROOT / "toponav" / "weights"
AREAS = ("area_1", "area_5b", "area_6", "area_3")
IMAGE_NAV_RUNS = (
    "rgbd",
    "rgb",
    "learned",
    "no_stop",
    "learned_no_stop",
    "no_noise",
    "learned_no_noise",
    "goals",
    "sliding",
)
TOP = """# Results

Laid out by `python benchmarks/results_page.py` from the runs in `benchmarks/results`; nothing is
typed in. What the numbers mean and why they are so is said in [best.md](best.md),
[nts.md](nts.md) and [baselines.md](baselines.md).
"""
GRAPHNAV = """## GraphNav: published pairs of four Stanford areas

`python benchmarks/graphnav_areas.py` drives them. The networks learned from generated offices, so
every area is unseen; area 3 chose settings (a validation set); the paper's networks saw areas
1, 5b and 6.
"""


def main(arguments: list[str]) -> int:
    """Write the page, or store curves."""
    try:
        if arguments[:1] == ["curves"]:
            store_curves(arguments[1:])
        elif arguments:
            print(__doc__)
            return 2
        else:
            print(write_atomically(PAGE, page()))
    except InputError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


def page() -> str:
    """The page as Markdown."""
    parts = [TOP, GRAPHNAV, *_graphnav(), *_ablations(), *_image_nav(), *_trained()]
    return "\n".join(part.rstrip("\n") + "\n" for part in parts)


def _graphnav() -> list[str]:
    folders = [RESULTS / "graphnav" / area for area in AREAS]
    stored = [load_results(folder) for folder in folders]
    lay_outs = (
        success_table,
        localization_table,
        prediction_table,
        rules_table,
        failures_table,
    )
    parts = [to_markdown(lay_out(stored)) for lay_out in lay_outs]
    rows = []
    for area, folder in zip(AREAS, folders, strict=True):
        run = read_json(folder / "run.json")
        commits = ", ".join(str(one)[:12] for one in run["episode_commits"])
        rows.append((area, str(len(run["episodes"])), str(run["source"]["seed"]), commits))
    columns = ("area", "pairs", "seed", "commits of the episodes")
    parts.append(to_markdown(PaperTable("Runs", columns, tuple(rows), (), 1)))
    for area in AREAS:
        there = f"../benchmarks/results/graphnav/{area}"
        parts.append(
            f"{area}, GraphNavPF: where runs ended, and the paths.\n\n"
            f"![Failure map of {area}]({there}/failures_graphnav_pf.png)\n"
            f"![Paths in {area}]({there}/trajectories_graphnav_pf.png)"
        )
    return parts


def _ablations() -> list[str]:
    path = RESULTS / "graphnav_ablations.md"
    if not path.exists():
        return []
    return ["## GraphNav: what each part is worth\n", path.read_text()]


def _image_nav() -> list[str]:
    folders = [RESULTS / "imagenav" / name for name in IMAGE_NAV_RUNS]
    stored = [load_image_nav_results(one) for one in folders if (one / "results.json").exists()]
    tables = [lay_out(stored) for lay_out in IMAGE_NAV_TABLES.values()]
    parts = [
        "## Neural Topological SLAM: image goals in unseen homes\n\n"
        "`python benchmarks/imagenav.py` drives them; the paper's homes are Gibson scans, ours "
        "are generated."
    ]
    return parts + [to_markdown(table) for table in tables if table.rows]


def _trained() -> list[str]:
    rows = []
    for path in sorted(WEIGHTS.glob("*/*.json")):
        about = read_json(path)
        size = path.with_suffix(".safetensors").stat().st_size
        of = about["metadata"]
        training = of.get("training") or {}
        rows.append(
            (
                path.parent.name,
                path.stem,
                f"{about['parameters']:,}",
                f"{size / 1e6:.2f}",
                str((of.get("metrics") or {}).get("epoch", "-")),
                f"{of['frames']:,}" if isinstance(of.get("frames"), int) else "-",
                str(training.get("threads", "-")),
            )
        )
    columns = ("preset", "network", "parameters", "MB", "epochs", "frames", "threads")
    notes = (
        "All were trained on two x86-64 processor cores without a graphics card; times are in the "
        "model cards beside the weights. frames: of reinforcement or imitation.",
    )
    parts = ["## What ships\n", to_markdown(PaperTable("Weights", columns, tuple(rows), notes, 2))]
    if CURVES.exists():
        minutes = [
            (name, str(len(lines)), f"{sum(line['seconds'] for line in lines) / 60:.0f}")
            for name, lines in read_json(CURVES)["networks"].items()
        ]
        names = ("network", "epochs", "minutes, one busy core")
        parts += [
            to_markdown(PaperTable("Training runs of GraphNav", names, tuple(minutes), (), 1)),
            "*repeated*: another run of the recipe; the log of what ships was not kept.\n\n"
            "![Training curves](images/graphnav-training.png)",
        ]
    return parts


def store_curves(folders: list[str]) -> None:
    """Store what training runs wrote, and draw it."""
    networks: dict[str, list[dict[str, Any]]] = {}
    for word in folders:
        name, _, folder = word.rpartition("=")
        for path in sorted(Path(folder).glob("*/metrics.jsonl")):
            lines = [json.loads(line) for line in path.read_text().splitlines()]
            networks[name or path.parent.name] = lines
    if not networks:
        raise InputError(
            "no metrics.jsonl lies there",
            where=" ".join(folders) or "curves",
            remedy="name folders that `toponav train` wrote",
        )
    text = json.dumps({"schema": 1, "networks": networks}, indent=1) + "\n"
    write_atomically(CURVES, text)
    print(write_atomically(PICTURE, _drawn(networks)))


def _drawn(networks: dict[str, list[dict[str, Any]]]) -> bytes:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(3.6 * len(networks), 5.4), layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.subplots(2, len(networks), squeeze=False)
    for column, (name, lines) in enumerate(networks.items()):
        epochs = [line["epoch"] for line in lines]
        for key, style in (("loss", "--"), ("val_loss", "-")):
            if key in lines[0]:
                label = "training" if key == "loss" else "held out"
                grid[0, column].plot(epochs, [line[key] for line in lines], style, label=label)
        grid[0, column].set_title(name)
        for key in lines[0]:
            if key.endswith(("_error_m", "_error_rad", "_error_rad_s", "_error_m_s", "error")) or (
                key in ("accuracy", "judged_right", "wrong_side", "replay_accuracy")
            ):
                shown = key.replace("_rad_s", ", rad/s").replace("_m_s", ", m/s")
                shown = shown.replace("_rad", ", rad").replace("_m", ", m").replace("_", " ")
                grid[1, column].plot(epochs, [line[key] for line in lines], ".-", label=shown)
        grid[1, column].set_xlabel("epoch")
        for row in (0, 1):
            grid[row, column].legend(fontsize=7)
            grid[row, column].grid(alpha=0.3)
    grid[0, 0].set_ylabel("loss")
    grid[1, 0].set_ylabel("on buildings held out")
    content = io.BytesIO()
    figure.savefig(content, format="png", dpi=110)
    return content.getvalue()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
