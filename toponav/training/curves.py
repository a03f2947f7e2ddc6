"""The course of training as JSON lines, a table and a picture."""

import csv
import io
import json
from collections.abc import Sequence
from pathlib import Path

from toponav.models.checkpoints import write_atomically

__all__ = ["draw_curves", "write_metrics"]


def write_metrics(directory: Path, history: Sequence[dict[str, int | float]]) -> None:
    """Write `metrics.jsonl` and `metrics.csv`, one record an epoch."""
    lines = "".join(json.dumps(record) + "\n" for record in history)
    write_atomically(directory / "metrics.jsonl", lines.encode())
    columns = list(dict.fromkeys(key for record in history for key in record))
    table = io.StringIO()
    writer = csv.DictWriter(table, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows(history)
    write_atomically(directory / "metrics.csv", table.getvalue().encode())


def draw_curves(directory: Path, history: Sequence[dict[str, int | float]], title: str) -> Path:
    """The path of `curve.png`: losses above, other metrics below."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 6.0), layout="constrained")
    FigureCanvasAgg(figure)
    losses, others = figure.subplots(2, 1, sharex=True)
    hidden = {"epoch", "score", "learning_rate", "seconds", "step"}
    for key in dict.fromkeys(key for record in history for key in record if key not in hidden):
        points = [(record["epoch"], record[key]) for record in history if key in record]
        axes = losses if key.endswith("loss") else others
        axes.plot(*zip(*points, strict=True), marker=".", label=key.replace("_", " "))
    losses.set_title(title.replace("_", " "))
    losses.set_ylabel("loss")
    others.set_xlabel("epoch")
    for axes in (losses, others):
        axes.grid(alpha=0.3)
        if axes.lines:
            axes.legend(fontsize=7, ncols=2)
    picture = io.BytesIO()
    figure.savefig(picture, format="png", dpi=110)
    path = directory / "curve.png"
    write_atomically(path, picture.getvalue())
    return path
