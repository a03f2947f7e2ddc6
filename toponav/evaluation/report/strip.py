"""The belief strip: plan edges down, time across, probability as colour, truth as a line."""

from dataclasses import dataclass
from html import escape

from toponav.evaluation.episode import EpisodeRecord
from toponav.evaluation.figures import belief_over_time
from toponav.evaluation.report.images import belief_image, data_url, png_bytes

__all__ = ["STRIP_LEFT_PX", "STRIP_WIDTH_PX", "belief_strip"]

STRIP_LEFT_PX = 250.0
"""Where the time axis begins."""
STRIP_WIDTH_PX = 830.0
"""How long the time axis is."""
_ROW_PX = 21.0
_TOP_PX = 8.0


@dataclass(frozen=True)
class _Rows:
    """Where rows lie."""

    count: int

    @property
    def height_px(self) -> float:
        return _TOP_PX + self.count * _ROW_PX + 34.0

    def top(self, row: int) -> float:
        return _TOP_PX + row * _ROW_PX

    def middle(self, row: int) -> float:
        return self.top(row) + _ROW_PX / 2


def belief_strip(record: EpisodeRecord) -> str:
    """The strip as SVG, with a cursor that the page's script moves."""
    matrix = belief_over_time(record)
    rows = _Rows(len(matrix))
    parts = [
        f'<svg class="strip" viewBox="0 0 1100 {rows.height_px:g}" role="img" '
        'aria-label="Belief over time, by plan edge">'
    ]
    parts += _labels(record, rows)
    height = rows.count * _ROW_PX
    picture = data_url(png_bytes(belief_image(matrix)), "image/png")
    parts.append(
        f'<image href="{picture}" x="{STRIP_LEFT_PX}" y="{_TOP_PX}" width="{STRIP_WIDTH_PX}" '
        f'height="{height:g}" preserveAspectRatio="none"/>'
    )
    parts.append(_truth_line(record, rows))
    parts += _time_axis(record, rows)
    bottom = _TOP_PX + height
    parts.append(
        f'<line class="cursor" x1="{STRIP_LEFT_PX}" x2="{STRIP_LEFT_PX}" y1="{_TOP_PX}" '
        f'y2="{bottom:g}"/><rect class="seek" x="{STRIP_LEFT_PX}" y="{_TOP_PX}" '
        f'width="{STRIP_WIDTH_PX}" height="{height:g}"/></svg>'
    )
    return "".join(parts)


def _labels(record: EpisodeRecord, rows: _Rows) -> list[str]:
    parts = []
    for row, behavior in enumerate(record.behaviors):
        target = record.plan.nodes[row + 1].replace("_", " ")
        y = rows.middle(row)
        parts.append(
            f'<rect class="row" x="{STRIP_LEFT_PX}" y="{rows.top(row) + 1}" '
            f'width="{STRIP_WIDTH_PX}" height="{_ROW_PX - 2}" rx="3"/>'
            f'<circle class="mark {behavior}" cx="8" cy="{y}" r="5"/>'
            f'<text x="22" y="{y + 4.5}">{escape(behavior.replace("_", " "))} '
            f"\N{RIGHTWARDS ARROW} {escape(target)}</text>"
        )
    y = rows.middle(rows.count - 1)
    parts.append(
        f'<rect class="row" x="{STRIP_LEFT_PX}" y="{rows.top(rows.count - 1) + 1}" '
        f'width="{STRIP_WIDTH_PX}" height="{_ROW_PX - 2}" rx="3"/>'
        f'<text x="22" y="{y + 4.5}">off the plan</text>'
    )
    return parts


def _truth_line(record: EpisodeRecord, rows: _Rows) -> str:
    """A line through the true edge of every step; a step without true node leaves a gap."""
    index = {node: position for position, node in enumerate(record.plan.nodes)}
    step_px = STRIP_WIDTH_PX / len(record.steps)
    path: list[str] = []
    last: int | None = None
    for number, step in enumerate(record.steps):
        row = None
        if step.true_node is not None:
            # At the goal there is no edge left: the line ends in the last one.
            on_plan = index.get(step.true_node)
            row = rows.count - 1 if on_plan is None else min(on_plan, rows.count - 2)
        if row is not None:
            left, right = (STRIP_LEFT_PX + (number + end) * step_px for end in (0, 1))
            y = rows.middle(row)
            path.append(f"{'L' if last is not None else 'M'}{left:.1f} {y:g}L{right:.1f} {y:g}")
        last = row
    return f'<path class="truth" d="{"".join(path)}"/>'


def _time_axis(record: EpisodeRecord, rows: _Rows) -> list[str]:
    total_s = record.steps[-1].time_s + 0.2
    tick_s = next((tick for tick in (2, 5, 10, 20, 30) if total_s / tick <= 9), 60)
    y = rows.top(rows.count) + 18
    parts = []
    for time_s in range(0, int(total_s) + 1, tick_s):
        x = STRIP_LEFT_PX + time_s / total_s * STRIP_WIDTH_PX
        parts.append(f'<text x="{x:.1f}" y="{y:g}" text-anchor="middle">{time_s} s</text>')
    return parts
