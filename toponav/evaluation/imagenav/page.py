"""The page of a search: the film, the moments that mattered, and the map over the true plan."""

import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path

import numpy as np
from PIL import Image

from toponav.core.files import check_out_folder, write_atomically
from toponav.core.imagenav import ImageNavEpisode
from toponav.evaluation.imagenav.agents import title_of
from toponav.evaluation.imagenav.episode import ImageNavRecord, StepView
from toponav.evaluation.imagenav.film import FILM_SIZE, PlanPanel, film_frames
from toponav.evaluation.imagenav.worker import ImageNavWorker
from toponav.evaluation.report.film import write_film
from toponav.evaluation.report.images import data_url
from toponav.worlds.scene import Scene

__all__ = ["EpisodePage", "film_episode", "search_section"]

_FPS = 8.0
_MOMENTS = 5
_OUTCOMES = {
    "success": "It stopped within a metre of the place.",
    "wrong_stop": "It stopped at the wrong place.",
    "timeout": "It ran out of steps.",
}
_STYLE = """
:root { color-scheme: light dark; --paper: #fbfaf8; --ink: #191c20; --muted: #667079;
  --rule: #e3e1dc; --card: #fff; --good: #18794e; --bad: #b5402a; }
@media (prefers-color-scheme: dark) { :root { --paper: #0e1217; --ink: #e8ecf1;
  --muted: #93a0ad; --rule: #28303a; --card: #151a21; --good: #4cc38a; --bad: #ff8e75; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--paper); color: var(--ink);
  font: 17px/1.6 "Inter", "Segoe UI", system-ui, -apple-system, Arial, sans-serif; }
main { max-width: 1120px; margin: 0 auto; padding: 48px 24px 96px; }
h1 { font-size: clamp(30px, 4.6vw, 46px); line-height: 1.08; letter-spacing: -0.03em;
  margin: 0 0 14px; }
h2 { font-size: 25px; letter-spacing: -0.02em; margin: 56px 0 8px; }
p { color: var(--muted); max-width: 760px; margin: 0 0 18px; }
.yes { color: var(--good); } .no { color: var(--bad); }
.facts { display: flex; flex-wrap: wrap; gap: 1px;
  background: var(--rule); border: 1px solid var(--rule); border-radius: 14px; overflow: hidden;
  margin: 24px 0; }
.facts div { background: var(--card); padding: 14px 18px; flex: 1 1 114px; }
.facts dt { color: var(--muted); font-size: 13.5px; }
.facts dd { margin: 2px 0 0; font-size: 23px; font-weight: 640; }
video, img { display: block; width: 100%; height: auto; border-radius: 12px; }
figure { margin: 0 0 28px; }
figcaption { color: var(--muted); font-size: 14.5px; margin: 8px 2px; }
"""


@dataclass(frozen=True)
class EpisodePage:
    """What `film_episode` wrote.

    Attributes:
        page: The page.
        film: The film beside it.
        record: What happened.
    """

    page: Path
    film: Path
    record: ImageNavRecord


def film_episode(
    worker: ImageNavWorker, label: str, episode: ImageNavEpisode, out: Path
) -> EpisodePage:
    """Runs an episode and writes `index.html` and `episode.mp4`.

    Args:
        worker: Has the agent.
        label: Label of the agent.
        episode: Which episode.
        out: Folder.

    Raises:
        InputError: If the folder cannot be written to, or the agent cannot be made.
    """
    check_out_folder(out)
    views: list[StepView] = []
    record = worker.run(label, episode, views.append)
    scene = worker.simulation(episode, depth=worker.choices[label].depth).scene
    title = title_of(label, worker.choices[label].agent)
    out.mkdir(parents=True, exist_ok=True)
    film = out / "episode.mp4"
    write_film(film, film_frames(scene, episode, views, title=title), _FPS, FILM_SIZE)
    page = out / "index.html"
    write_atomically(page, _page(scene, record, views, title))
    return EpisodePage(page, film, record)


def search_section(made: EpisodePage) -> str:
    """A section for another page: the film of a search, and the way to its own page (HTML)."""
    record, goal = made.record, made.record.goals[0]
    film = data_url(made.film.read_bytes(), "video/mp4")
    return (
        "<h2>Without a map: a place it has only a picture of</h2>"
        '<p class="intro">The second paper, <b>Neural Topological SLAM</b>, in a home that no '
        "training run saw: panoramas in, four actions out, wheels that slip. The robot builds the "
        "graph in blue as it goes, drives to the unexplored place with the best score, and says "
        f"stop where the picture was taken. <b>{_OUTCOMES[goal.outcome]}</b> It drove "
        f"{goal.path_m:.1f} m in {goal.steps} actions; the shortest path has "
        f"{goal.geodesic_m:.1f} m.</p>"
        f'<figure><div class="card"><video src="{film}" controls muted playsinline '
        'preload="metadata" style="width:100%"></video></div><figcaption>Episode '
        f"{escape(record.episode.id)}; bars are directions that it thinks explorable, numbers "
        f'their scores. <a href="image-goal/{made.page.name}">Its own page</a> shows the map and '
        "the moments that mattered.</figcaption></figure>"
    )


def _page(scene: Scene, record: ImageNavRecord, views: Sequence[StepView], title: str) -> str:
    episode, goal = record.episode, record.goals[0]
    kind = "yes" if goal.success else "no"
    facts = [
        ("Shortest path", f"{goal.geodesic_m:.1f} m"),
        ("Driven", f"{goal.path_m:.1f} m"),
        ("SPL", f"{goal.spl:.2f}"),
        ("Actions", str(goal.steps)),
        ("Blocked", str(goal.collisions)),
        (
            "Left to the goal",
            f"{goal.distance_m:.1f} m" if math.isfinite(goal.distance_m) else "-",
        ),
        ("Rooms", str(record.rooms)),
    ]
    cells = "".join(f"<div><dt>{name}</dt><dd>{value}</dd></div>" for name, value in facts)
    reason = f" It says: {escape(goal.reason)}." if goal.reason else ""
    final = PlanPanel(scene, (1080, 760)).draw(
        episode, views[-1].belief, [view.pose for view in views], views[-1].goal_pose
    )
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(title)}: {escape(episode.id)}</title><style>{_STYLE}</style></head>"
        f"<body><main><h1>{escape(title)} looks for a place it has only a picture of</h1>"
        f'<p><b class="{kind}">{_OUTCOMES[goal.outcome]}</b>{reason} Episode '
        f"{escape(episode.id)}, home {episode.scene_seed}, which no training run saw.</p>"
        f'<dl class="facts">{cells}</dl>'
        '<video src="episode.mp4" controls muted playsinline preload="metadata"></video>'
        "<h2>The map it built</h2><p>Nodes and edges in blue, unexplored places as dots, the "
        "greener the better the score, over the true plan, which the robot never saw. The map "
        "lies where the robot believes it to be: what is off is what its wheels got wrong. Black "
        "is the path that it drove, gold the goal and the metre around it.</p>"
        f'<figure><img src="{_jpeg_url(final)}" alt="The plan with the map"></figure>'
        f"<h2>Moments</h2>{_moments(scene, episode, views, title)}</main></body></html>"
    )


def _moments(scene: Scene, episode: ImageNavEpisode, views: Sequence[StepView], title: str) -> str:
    chosen = _choose(views)
    frames = film_frames(scene, episode, views, title=title, only=chosen)
    parts = []
    for number, frame in zip(chosen, frames, strict=True):
        belief = views[number].belief
        caption = (
            f"Step {number}: {escape(belief.mode or 'acting')}, {len(belief.nodes)} nodes, "
            f"{len(belief.ghosts)} unexplored places."
        )
        url = _jpeg_url(Image.fromarray(frame))
        parts.append(
            f'<figure><img src="{url}" alt="Step {number}" loading="lazy">'
            f"<figcaption>{caption}</figcaption></figure>"
        )
    return "".join(parts)


def _choose(views: Sequence[StepView]) -> list[int]:
    """The first and last step, changes of what it does, and some between them."""
    last = len(views) - 1
    modes = [view.belief.mode for view in views]
    changes = [step for step in range(1, last) if modes[step] != modes[step - 1]]
    spread = np.linspace(0, last, _MOMENTS).astype(int).tolist()
    found = sorted({0, last, *changes[:2], *spread})
    return (
        found[: _MOMENTS + 1] if last not in found[_MOMENTS + 1 :] else [*found[:_MOMENTS], last]
    )


def _jpeg_url(image: Image.Image) -> str:
    content = io.BytesIO()
    image.convert("RGB").save(content, format="JPEG", quality=84)
    return data_url(content.getvalue(), "image/jpeg")
