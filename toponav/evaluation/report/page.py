"""Assembles the page: one HTML file that needs no other and no network."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from importlib import resources
from string import Template
from typing import Any

from toponav.core.vocabulary import Behavior, Outcome
from toponav.evaluation.agents import AGENTS
from toponav.evaluation.episode import EpisodeRecord
from toponav.evaluation.report.images import colorize_depth, data_url, depth_palette_css, png_bytes
from toponav.evaluation.report.strip import STRIP_LEFT_PX, STRIP_WIDTH_PX, belief_strip
from toponav.evaluation.report.svg import (
    Canvas,
    floor_defs,
    map_layer,
    path_layer,
    plan_layer,
    room_names,
)
from toponav.evaluation.suite import Suite

__all__ = ["DemoReport", "DepthView", "agent_title", "render_page"]

_OUTCOME_WORDS = {
    Outcome.SUCCESS: "reached",
    Outcome.DEVIATED: "left the plan",
    Outcome.STUCK: "got stuck",
    Outcome.COLLIDED: "touched something",
    Outcome.TIMEOUT: "ran out of time",
}


@dataclass(frozen=True, eq=False)
class DepthView:
    """One depth image worth showing."""

    depth: Any
    caption: str


@dataclass(frozen=True, eq=False)
class DemoReport:
    """Everything that the page shows.

    Attributes:
        suite: The building, its map and the plans.
        agents: Agents in the order of the table; the first is the one the page is about.
        records: What happened, by agent and episode.
        hero: The drive shown in the film, the strip and the large plan.
        beliefs: Edge probabilities at each step of that drive.
        views: Depth images of that drive.
        film: The film (mp4).
        fps: Frames of the film per second; one frame is one step of 0.2 s.
        area_m2: Floor of the building.
        real_time_factor: Simulated seconds per second of computing, by the first agent.
        facts: Lines for the foot of the page.
        search: Section about a search for the place in a picture, where there was one (HTML).
    """

    suite: Suite
    agents: tuple[str, ...]
    records: Mapping[tuple[str, int], EpisodeRecord]
    hero: EpisodeRecord
    beliefs: Sequence[Mapping[str, float]]
    views: Sequence[DepthView]
    film: bytes
    fps: float
    area_m2: float
    real_time_factor: float
    facts: Sequence[str]
    search: str = ""

    def record(self, agent: str, index: int) -> EpisodeRecord:
        """What happened in one episode."""
        return self.records[agent, index]

    def successes(self, agent: str) -> int:
        """How many plans an agent completed, by the tolerant rule."""
        return sum(self.record(agent, task.index).tolerant.success for task in self.suite.tasks)


def render_page(report: DemoReport) -> str:
    """The page as HTML."""
    canvas = Canvas.around(report.suite.scene)
    template = Template(_resource("page.html"))
    return template.substitute(
        style=_resource("style.css"),
        script=_resource("script.js"),
        agent=escape(agent_title(report.agents[0])),
        facts=_facts(report),
        film=data_url(report.film, "video/mp4"),
        film_note=_film_note(report),
        speed=f"{report.fps / 5:g}",
        strip=belief_strip(report.hero),
        floor=floor_defs(canvas, report.suite.scene),
        hero_plan=_hero_plan(report, canvas),
        behaviors=_behavior_legend(),
        palette=depth_palette_css(),
        views=_views(report),
        plans=_small_plans(report, canvas),
        agents_legend=_agent_legend(report),
        outcome_head=_outcome_head(report),
        outcome_rows=_outcome_rows(report),
        outcome_foot=_outcome_foot(report),
        drive=_drive_json(report, canvas),
        search=report.search,
        foot=" · ".join(escape(line) for line in report.facts),
    )


def _resource(name: str) -> str:
    return resources.files("toponav.evaluation.report").joinpath(name).read_text("utf-8")


def agent_title(agent: str) -> str:
    """The name of an agent for people."""
    return AGENTS[agent].title if agent in AGENTS else agent.rpartition(":")[2]


def _css_class(agent: str) -> str:
    return agent if agent in AGENTS else "other"


def _facts(report: DemoReport) -> str:
    count = len(report.suite.tasks)
    scene = report.suite.scene
    items = [
        (f"Building, {report.area_m2:.0f} m²", f"{len(scene.rooms)} <small>rooms</small>"),
        ("Plans to follow", str(count)),
        *(
            (
                f"{escape(agent_title(agent))} arrived",
                f"{report.successes(agent)} <small>of {count}</small>",
            )
            for agent in report.agents
        ),
        ("Speed", f"{report.real_time_factor:.0f}&times; <small>real time</small>"),
    ]
    return "".join(f"<div><dt>{name}</dt><dd>{value}</dd></div>" for name, value in items)


def _film_note(report: DemoReport) -> str:
    agent, hero = escape(agent_title(report.agents[0])), report.hero
    way = f"{_place(hero.plan.nodes[0])} to {_place(hero.plan.nodes[-1])}"
    if hero.tolerant.success:
        return (
            f"Shown is the longest plan that {agent} completed: {way}, "
            f"{hero.driven_m:.0f}&nbsp;m in {hero.tolerant.time_s:.0f}&nbsp;s."
        )
    return (
        f"{agent} completed no plan this time. Shown is the drive that got furthest: {way}, "
        f"{hero.tolerant.nodes_reached} of {hero.tolerant.plan_nodes} nodes, then it "
        f"{_OUTCOME_WORDS[hero.tolerant.outcome]}."
    )


def _place(node: str) -> str:
    return escape(node.replace("_", " "))


def _svg(canvas: Canvas, content: str, attributes: str = "") -> str:
    return (
        f'<svg viewBox="{canvas.view_box}" role="img" {attributes}>'
        f'<use href="#floor"/>{content}</svg>'
    )


def _hero_plan(report: DemoReport, canvas: Canvas) -> str:
    suite, hero = report.suite, report.hero
    robot = '<g class="robot" hidden><circle r="11"/><path d="M9 0L-4 -5.5L-1.5 0L-4 5.5z"/></g>'
    content = (
        room_names(canvas, suite.scene)
        + plan_layer(canvas, suite.map, hero.plan)
        + map_layer(canvas, suite.map, hero.plan)
        + _path(canvas, hero, "drive")
        + robot
    )
    return _svg(canvas, content, 'id="hero" aria-label="Floor plan, map, plan and driven path"')


def _path(canvas: Canvas, record: EpisodeRecord, kind: str) -> str:
    points = [(step.x_m, step.y_m) for step in record.steps]
    label = f"{agent_title(record.agent)}: {_OUTCOME_WORDS[record.tolerant.outcome]}"
    return path_layer(canvas, points, kind, label, not record.tolerant.success)


def _small_plans(report: DemoReport, canvas: Canvas) -> str:
    parts = []
    for number, task in enumerate(report.suite.tasks, start=1):
        content = plan_layer(canvas, report.suite.map, task.plan)
        for agent in reversed(report.agents):
            content += _path(canvas, report.record(agent, task.index), _css_class(agent))
        way = f"{_place(task.plan.nodes[0])} to {_place(task.plan.nodes[-1])}"
        parts.append(
            f'<figure><div class="card pad">{_svg(canvas, content)}</div>'
            f"<figcaption><b>Plan {number}.</b> {way}</figcaption></figure>"
        )
    return "".join(parts)


def _behavior_legend() -> str:
    return "".join(
        f'<li><span class="swatch {behavior} tint"></span>{behavior.replace("_", " ")}</li>'
        for behavior in Behavior
    )


def _agent_legend(report: DemoReport) -> str:
    return "".join(
        f'<li><span class="swatch {_css_class(agent)} tint"></span>'
        f"{escape(agent_title(agent))}</li>"
        for agent in report.agents
    )


def _views(report: DemoReport) -> str:
    parts = []
    for view in report.views:
        picture = data_url(png_bytes(colorize_depth(view.depth)), "image/png")
        caption = escape(view.caption)
        parts.append(
            f'<figure><img src="{picture}" alt="Depth image: {caption}" loading="lazy">'
            f"<figcaption>{caption}</figcaption></figure>"
        )
    return "".join(parts)


def _outcome_head(report: DemoReport) -> str:
    agents = "".join(f"<th>{escape(agent_title(agent))}</th>" for agent in report.agents)
    return f"<tr><th>Plan</th>{agents}</tr>"


def _outcome_rows(report: DemoReport) -> str:
    rows = []
    for number, task in enumerate(report.suite.tasks, start=1):
        way = f"{_place(task.plan.nodes[0])} to {_place(task.plan.nodes[-1])}"
        cells = "".join(
            f"<td>{_outcome_cell(report.record(agent, task.index))}</td>"
            for agent in report.agents
        )
        rows.append(
            f"<tr><th>{number}. {way}<small>{len(task.plan.nodes)} nodes</small></th>{cells}</tr>"
        )
    return "".join(rows)


def _outcome_cell(record: EpisodeRecord) -> str:
    strict, tolerant = record.strict, record.tolerant
    if strict.success:
        return f'<span class="yes">reached</span><small>{strict.time_s:.0f} s</small>'
    if tolerant.success:
        return (
            f'<span class="partly">reached</span><small>{tolerant.time_s:.0f} s, but off the plan '
            f"for a moment near {_place(strict.node or 'nowhere')}</small>"
        )
    word = _OUTCOME_WORDS[tolerant.outcome]
    if tolerant.contact:
        word = f"touched {escape(tolerant.contact)}"
    return (
        f'<span class="no">{word}</span><small>after {tolerant.nodes_reached} of '
        f"{tolerant.plan_nodes} nodes</small>"
    )


def _outcome_foot(report: DemoReport) -> str:
    count = len(report.suite.tasks)
    cells = []
    for agent in report.agents:
        found = [report.record(agent, task.index) for task in report.suite.tasks]
        strict = sum(record.strict.success for record in found)
        completion = sum(record.tolerant.plan_completion for record in found) / count
        cells.append(
            f"<td>{report.successes(agent)} of {count}<small>strictly {strict}; "
            f"{100 * completion:.0f} % of the nodes</small></td>"
        )
    return f"<tr><th>Arrived</th>{''.join(cells)}</tr>"


def _drive_json(report: DemoReport, canvas: Canvas) -> str:
    """What the script needs, with edges by number to keep it small."""
    edges = sorted({edge for belief in report.beliefs for edge in belief})
    number = {edge: position for position, edge in enumerate(edges)}
    poses = [
        (*canvas.at(step.x_m, step.y_m), round(-math.degrees(step.yaw_rad), 1))
        for step in report.hero.steps
    ]
    beliefs = []
    for belief in report.beliefs:
        likely = sorted(belief.items(), key=lambda item: -item[1])[:6]
        beliefs.append([[number[edge], round(p, 3)] for edge, p in likely if p > 0.02])
    drive = {
        "fps": report.fps,
        "left": STRIP_LEFT_PX,
        "width": STRIP_WIDTH_PX,
        "edges": edges,
        "poses": poses,
        "beliefs": beliefs,
    }
    return json.dumps(drive, separators=(",", ":")).replace("<", "\\u003c")
