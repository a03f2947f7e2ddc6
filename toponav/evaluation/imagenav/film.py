"""The film of a search: panorama with predicted directions, goal, and the graph on the plan."""

import itertools
import math
from collections.abc import Collection, Iterator, Sequence
from functools import lru_cache

import numpy as np
from jaxtyping import Int64, UInt8
from PIL import Image, ImageDraw, ImageFont

from toponav.core.geometry import Pose2
from toponav.core.imagenav import (
    DIRECTIONS,
    IMAGE_NAV_ROBOT_RADIUS_M,
    SUCCESS_RADIUS_M,
    ImageNavBelief,
    ImageNavEpisode,
)
from toponav.evaluation.imagenav.episode import StepView
from toponav.models.nts.panorama import column_yaw_rad
from toponav.worlds.draw import plan_image
from toponav.worlds.scene import Scene

__all__ = ["FILM_SIZE", "PlanPanel", "film_frames"]

FILM_SIZE = (1280, 928)
"""Width and height of a frame."""

_PANORAMA = (28, 74, 1224, 306)  # left, top, width, height
_BARS = (28, 388, 1224, 62)
_GOAL = (28, 516, 560, 140)
_PLAN = (628, 482, 624, 418)
_BACKGROUND = (13, 17, 23)
_TEXT, _MUTED = (230, 237, 243), (139, 152, 165)
_GRAPH, _SUBGOAL, _GOLD, _TRAIL = (37, 99, 235), (214, 51, 108), (245, 190, 40), (25, 28, 32)
_LOW, _HIGH = np.array([88, 96, 112]), np.array([46, 200, 120])


def film_frames(
    scene: Scene,
    episode: ImageNavEpisode,
    views: Sequence[StepView],
    *,
    title: str,
    only: Collection[int] | None = None,
) -> Iterator[UInt8[np.ndarray, "height width 3"]]:
    """One frame an action.

    Args:
        scene: The building.
        episode: Where the search began; the agent's map is laid there.
        views: What to show.
        title: Name of the agent.
        only: Numbers of the actions to draw; all if left out.
    """
    panel = PlanPanel(scene, _PLAN[2:])
    trail: list[Pose2] = []
    for number, view in enumerate(views):
        trail.append(view.pose)
        if only is not None and number not in only:
            continue
        frame = Image.new("RGB", FILM_SIZE, _BACKGROUND)
        _paste(frame, view.observation.rgb, _PANORAMA)
        _paste(frame, view.goal_image.rgb, _GOAL)
        _draw_directions(frame, view.belief)
        picture = panel.draw(episode, view.belief, trail, view.goal_pose)
        frame.paste(picture, _PLAN[:2])
        _write(frame, view, title, number)
        yield np.asarray(frame)


class PlanPanel:
    """The true plan, with what the agent thinks drawn over it.

    Args:
        scene: The building.
        size: Width and height in pixels.
    """

    def __init__(self, scene: Scene, size: tuple[int, int]) -> None:
        image = plan_image(scene)
        used = np.argwhere(scene.occupied | (scene.room_index >= 0))
        (row0, col0), (row1, col1) = used.min(axis=0), used.max(axis=0) + 1
        cell_m = scene.grid.resolution_m
        self.px_per_m = min(size[0] / (col1 - col0), size[1] / (row1 - row0)) / cell_m
        wide = round((col1 - col0) * cell_m * self.px_per_m)
        high = round((row1 - row0) * cell_m * self.px_per_m)
        floor = Image.fromarray(np.ascontiguousarray(image[row0:row1, col0:col1][::-1]))
        self.still = Image.new("RGB", size, (255, 255, 255))
        self._shift = ((size[0] - wide) // 2, (size[1] - high) // 2)
        self.still.paste(floor.resize((wide, high), Image.Resampling.BOX), self._shift)
        self._left_m = scene.grid.origin_m[0] + col0 * cell_m
        self._top_m = scene.grid.origin_m[1] + row1 * cell_m

    def at(self, x_m: float, y_m: float) -> tuple[float, float]:
        """The pixel of a point."""
        return (
            self._shift[0] + (x_m - self._left_m) * self.px_per_m,
            self._shift[1] + (self._top_m - y_m) * self.px_per_m,
        )

    def draw(
        self,
        episode: ImageNavEpisode,
        belief: ImageNavBelief,
        trail: Sequence[Pose2],
        goal: Pose2,
    ) -> Image.Image:
        """The plan with the driven path, the goal, and the agent's graph from the true start."""
        image = self.still.copy()
        draw = ImageDraw.Draw(image, "RGBA")
        reach = SUCCESS_RADIUS_M * self.px_per_m
        _ring(draw, self.at(goal.x_m, goal.y_m), reach, (*_GOLD, 70))
        _ring(draw, self.at(goal.x_m, goal.y_m), 6, (*_GOLD, 255), outline=_TRAIL)
        if len(trail) > 1:
            points = [self.at(pose.x_m, pose.y_m) for pose in trail]
            draw.line(points, fill=(*_TRAIL, 170), width=2, joint="curve")
        self._draw_graph(draw, episode.start, belief)
        robot = trail[-1]
        center = self.at(robot.x_m, robot.y_m)
        nose = robot.compose(Pose2(0.4, 0.0, 0.0))
        draw.line([center, self.at(nose.x_m, nose.y_m)], fill=(*_TRAIL, 255), width=3)
        radius = IMAGE_NAV_ROBOT_RADIUS_M * self.px_per_m
        _ring(draw, center, radius, (255, 255, 255, 255), outline=_TRAIL)
        return image

    def _draw_graph(self, draw: ImageDraw.ImageDraw, start: Pose2, belief: ImageNavBelief) -> None:
        def place(pose: Pose2) -> tuple[float, float]:
            there = start.compose(pose)
            return self.at(there.x_m, there.y_m)

        nodes = [place(node.pose) for node in belief.nodes]
        for ghost in belief.ghosts:
            ends = [nodes[ghost.node], place(ghost.pose)]
            draw.line(ends, fill=(*_GRAPH, 70), width=1)
            _ring(draw, ends[1], 5, (*_score_color(ghost.score), 235), outline=_TRAIL)
        for edge in belief.edges:
            draw.line([nodes[edge.source], nodes[edge.target]], fill=(*_GRAPH, 200), width=3)
        for number, point in enumerate(nodes):
            radius = 7 if number == belief.node else 5
            _ring(draw, point, radius, (*_GRAPH, 255), outline=(255, 255, 255))
        if belief.goal is not None:
            _ring(draw, place(belief.goal), 9, (0, 0, 0, 0), outline=_GOLD, width=3)
        if belief.subgoal is not None:
            x, y = place(belief.subgoal)
            draw.line([(x - 7, y - 7), (x + 7, y + 7)], fill=(*_SUBGOAL, 255), width=3)
            draw.line([(x - 7, y + 7), (x + 7, y - 7)], fill=(*_SUBGOAL, 255), width=3)


@lru_cache(maxsize=4)
def _bin_columns(width: int) -> Int64[np.ndarray, " width"]:
    """The direction bin that each column of a panorama looks in."""
    yaw_rad = column_yaw_rad(width)
    bins = np.floor(yaw_rad * DIRECTIONS / (2 * math.pi) + 0.5).astype(np.int64) % DIRECTIONS
    return np.asarray(bins)


def _draw_directions(frame: Image.Image, belief: ImageNavBelief) -> None:
    """Bars below the panorama: height is F_G, colour is F_S; the best score has a mark."""
    draw = ImageDraw.Draw(frame, "RGBA")
    left, top, width, height = _BARS
    if belief.explorable is None:
        return
    bins = _bin_columns(512)
    starts = [0, *(np.flatnonzero(np.diff(bins)) + 1).tolist(), len(bins)]
    for begin, end in itertools.pairwise(starts):
        number = int(bins[begin])
        x0, x1 = left + begin * width / len(bins) + 1, left + end * width / len(bins) - 1
        share = float(np.clip(belief.explorable[number], 0.0, 1.0))
        score = None if belief.score is None else float(belief.score[number])
        draw.rectangle([x0, top, x1, top + height], fill=(28, 36, 45, 255))
        bar = top + height * (1 - share)
        draw.rectangle([x0, bar, x1, top + height], fill=(*_score_color(score), 255))
        if score is not None and x1 - x0 > 40:
            label = f"{score:.2f}"
            font = _font(15)
            draw.text(((x0 + x1) / 2, top + 10), label, font=font, fill=_TEXT, anchor="mm")


def _score_color(score: float | None) -> tuple[int, int, int]:
    share = 0.0 if score is None else min(max(score, 0.0), 1.0) ** 0.7
    red, green, blue = (_LOW + share * (_HIGH - _LOW)).astype(int).tolist()
    return red, green, blue


def _paste(frame: Image.Image, rgb: np.ndarray, box: tuple[int, int, int, int]) -> None:
    left, top, width, height = box
    size = (width, height)
    frame.paste(Image.fromarray(rgb).resize(size, Image.Resampling.LANCZOS), (left, top))


def _write(frame: Image.Image, view: StepView, title: str, number: int) -> None:
    draw = ImageDraw.Draw(frame)
    belief = view.belief
    big, small = _font(22), _font(16)
    draw.text((28, 28), f"What {title} sees", font=big, fill=_TEXT)
    right = FILM_SIZE[0] - 28
    draw.text((right, 34), f"step {number}", font=small, fill=_MUTED, anchor="ra")
    middle = _PANORAMA[0] + _PANORAMA[2] // 2
    draw.text((middle, 34), "forward", font=small, fill=_MUTED, anchor="ma")
    note = "bar: explorable (F_G); green and number: score towards the goal (F_S)"
    draw.text((28, 456), note, font=small, fill=_MUTED)
    draw.text((28, 484), "The place to find", font=big, fill=_TEXT)
    lines = [
        ("doing", belief.mode or "-"),
        ("action", view.action.name.lower()),
        ("map", f"{len(belief.nodes)} nodes, {len(belief.ghosts)} unexplored"),
        ("goal", "seen" if belief.goal is not None else "not seen yet"),
    ]
    if belief.stopped_because:
        lines.append(("because", belief.stopped_because))
    for line, (name, value) in enumerate(lines):
        y = 686 + 30 * line
        draw.text((28, y), name, font=small, fill=_MUTED)
        draw.text((120, y), value, font=small, fill=_TEXT)
    keys = [
        ("node", _GRAPH),
        ("unexplored", tuple(((_LOW + _HIGH) // 2).tolist())),
        ("subgoal", _SUBGOAL),
        ("goal", _GOLD),
    ]
    x = 28.0
    for name, color in keys:
        _ring(draw, (x + 6, 880), 6, (*color, 255))
        draw.text((x + 18, 870), name, font=small, fill=_MUTED)
        x += 40 + draw.textlength(name, font=small)


@lru_cache(maxsize=4)
def _font(size: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(size)


def _ring(
    draw: ImageDraw.ImageDraw,
    center: tuple[float | int, float | int],
    radius: float | int,
    fill: tuple[int, ...],
    outline: tuple[int, int, int] | None = None,
    width: int = 1,
) -> None:
    x, y = center
    box = [x - radius, y - radius, x + radius, y + radius]
    draw.ellipse(box, fill=fill if any(fill) else None, outline=outline, width=width)
