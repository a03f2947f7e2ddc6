"""The film of one drive: the coloured depth image beside the plan, belief lit up on its edges."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import imageio_ffmpeg
import numpy as np
from jaxtyping import UInt8
from PIL import Image, ImageDraw, ImageFont

from toponav.core.geometry import Pose2
from toponav.core.vocabulary import Behavior
from toponav.evaluation.report.images import colorize_depth
from toponav.maps.plan import Plan
from toponav.maps.spec import TopologicalMap
from toponav.worlds.grid import SemanticClass
from toponav.worlds.scene import Scene

__all__ = ["BEHAVIOR_RGB", "FilmStep", "film_frames", "write_film"]

_SIZE = (1280, 624)
_DEPTH_BOX = (28, 128, 560, 420)  # left, top, width, height
_PLAN_BOX = (616, 128, 636, 448)
_BACKGROUND = (13, 17, 23)
_TEXT, _MUTED = (230, 237, 243), (139, 152, 165)
_ROOM, _PASSAGE, _WALL, _FURNITURE = (28, 36, 45), (37, 47, 58), (150, 163, 176), (64, 76, 88)
_BELIEF = (92, 160, 255)
_ROBOT = (255, 255, 255)
_FINER = 2
_MARGIN_M = 2.0
_PX_PER_M = (26.0, 60.0)
_VIEW_RAD = math.radians(150.0)

BEHAVIOR_RGB: Mapping[Behavior, tuple[int, int, int]] = {
    Behavior.CORRIDOR_FOLLOW: (86, 180, 233),
    Behavior.FIND_DOOR: (230, 159, 0),
    Behavior.TURN_LEFT: (38, 190, 140),
    Behavior.TURN_RIGHT: (232, 112, 60),
    Behavior.STRAIGHT: (214, 140, 184),
}


@dataclass(frozen=True, eq=False)
class FilmStep:
    """What one frame shows.

    Attributes:
        time_s: Seconds since the drive began.
        depth: Depth image, one byte a pixel.
        pose: True pose of the robot.
        behavior: Behaviour executed.
        edge_probability: What the robot believes, by edge.
        believed: Where the robot thinks it is.
        true: Where it really is.
    """

    time_s: float
    depth: UInt8[np.ndarray, "height width"]
    pose: Pose2
    behavior: Behavior | None
    edge_probability: Mapping[str, float]
    believed: str
    true: str


class _PlanPanel:
    """The right half: where metres fall, and what does not change from frame to frame.

    Where the whole plan would be too small to read, the picture follows the robot instead.
    """

    def __init__(
        self, scene: Scene, map_: TopologicalMap, plan: Plan, path: Sequence[Pose2]
    ) -> None:
        nodes = [map_.node(node) for node in plan.nodes]
        x_m = [node.x_m for node in nodes] + [pose.x_m for pose in path]
        y_m = [node.y_m for node in nodes] + [pose.y_m for pose in path]
        width_m = max(x_m) - min(x_m) + 2 * _MARGIN_M
        height_m = max(y_m) - min(y_m) + 2 * _MARGIN_M
        self.window = (_PLAN_BOX[2] * _FINER, _PLAN_BOX[3] * _FINER)
        whole = min(self.window[0] / width_m, self.window[1] / height_m)
        self.scale = min(max(whole, _FINER * _PX_PER_M[0]), _FINER * _PX_PER_M[1])
        size = (
            max(self.window[0], round(width_m * self.scale)),
            max(self.window[1], round(height_m * self.scale)),
        )
        self._left_m = (min(x_m) + max(x_m)) / 2 - size[0] / 2 / self.scale
        self._top_m = (min(y_m) + max(y_m)) / 2 + size[1] / 2 / self.scale
        self._map = map_
        self.still = self._draw_still(scene, plan, size)

    def at(self, x_m: float, y_m: float) -> tuple[float, float]:
        """The pixel of a point."""
        return (x_m - self._left_m) * self.scale, (self._top_m - y_m) * self.scale

    def edge(self, edge_id: str) -> list[tuple[float, float]]:
        """The two ends of an edge, in pixels."""
        edge = self._map.edge(edge_id)
        ends = (self._map.node(edge.source), self._map.node(edge.target))
        return [self.at(node.x_m, node.y_m) for node in ends]

    def view(self, center: tuple[float, float]) -> tuple[int, int, int, int]:
        """The part of the picture to show when the robot is at this pixel."""
        corners = []
        for middle, width, whole in zip(center, self.window, self.still.size, strict=True):
            corners.append(round(min(max(middle - width / 2, 0), whole - width)))
        left, top = corners
        return left, top, left + self.window[0], top + self.window[1]

    def _draw_still(self, scene: Scene, plan: Plan, size: tuple[int, int]) -> Image.Image:
        image = Image.fromarray(self._floor(scene, size))
        draw = ImageDraw.Draw(image, "RGBA")
        for edge in self._map.edges:
            draw.line(self.edge(edge.id), fill=(255, 255, 255, 36), width=2)
        for edge_id in plan.edges:
            color = BEHAVIOR_RGB[self._map.edge(edge_id).behavior]
            draw.line(self.edge(edge_id), fill=(*color, 190), width=6)
        for node_id in plan.nodes:
            node = self._map.node(node_id)
            _disc(draw, self.at(node.x_m, node.y_m), 5.0, (255, 255, 255, 190))
        goal = self._map.node(plan.nodes[-1])
        for radius, alpha in ((22.0, 60), (12.0, 230)):
            _disc(draw, self.at(goal.x_m, goal.y_m), radius, (255, 214, 90, alpha))
        return image

    def _floor(self, scene: Scene, size: tuple[int, int]) -> np.ndarray:
        """The floor plan by looking up the cell under every pixel; black outside."""
        grid = scene.grid
        cols = np.arange(size[0]) / self.scale + self._left_m - grid.origin_m[0]
        rows = self._top_m - np.arange(size[1]) / self.scale - grid.origin_m[1]
        col = np.floor(cols / grid.resolution_m).astype(int)
        row = np.floor(rows / grid.resolution_m).astype(int)
        inside = ((row >= 0) & (row < grid.rows))[:, None] & ((col >= 0) & (col < grid.cols))
        cells = np.ix_(np.clip(row, 0, grid.rows - 1), np.clip(col, 0, grid.cols - 1))
        enclosed = np.array([room.kind.is_enclosed for room in scene.rooms] + [True])
        colors = np.array([_BACKGROUND, _ROOM, _PASSAGE, _FURNITURE, _WALL], np.uint8)
        room = scene.room_index[cells]
        kind = np.where(room < 0, 0, np.where(enclosed[room], 1, 2))
        solid, semantics = scene.occupied[cells], scene.semantics[cells]
        kind = np.where(solid, 3, kind)
        kind = np.where(solid & (semantics <= SemanticClass.WINDOW), 4, kind)
        return np.asarray(colors[np.where(inside, kind, 0)])


def film_frames(
    scene: Scene,
    map_: TopologicalMap,
    plan: Plan,
    steps: Sequence[FilmStep],
    *,
    title: str,
    max_depth_m: float,
) -> Iterator[UInt8[np.ndarray, "height width 3"]]:
    """One frame a step.

    Args:
        scene: The building.
        map_: Its topological map.
        plan: The plan that the robot follows.
        steps: What to show.
        title: Name of the agent.
        max_depth_m: How far the camera sees; drawn as the view cone.
    """
    panel = _PlanPanel(scene, map_, plan, [step.pose for step in steps])
    fonts = {size: ImageFont.load_default(size) for size in (17, 22)}
    trail: list[tuple[float, float]] = []
    for step in steps:
        trail.append(panel.at(step.pose.x_m, step.pose.y_m))
        frame = Image.new("RGB", _SIZE, _BACKGROUND)
        _paste_depth(frame, step)
        frame.paste(_plan_image(panel, step, trail, max_depth_m), _PLAN_BOX[:2])
        _write(frame, step, fonts, title)
        yield np.asarray(frame)


def _paste_depth(frame: Image.Image, step: FilmStep) -> None:
    left, top, width, height = _DEPTH_BOX
    image = Image.fromarray(colorize_depth(step.depth))
    frame.paste(image.resize((width, height), Image.Resampling.BILINEAR), (left, top))


def _plan_image(
    panel: _PlanPanel, step: FilmStep, trail: list[tuple[float, float]], max_depth_m: float
) -> Image.Image:
    view = panel.view(trail[-1])
    image = panel.still.crop(view)
    draw = ImageDraw.Draw(image, "RGBA")

    def shift(points: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
        return [(x - view[0], y - view[1]) for x, y in points]

    center = shift(trail[-1:])[0]
    reach = max_depth_m * panel.scale
    heading = -math.degrees(step.pose.yaw_rad)
    half = math.degrees(_VIEW_RAD) / 2
    box = [center[0] - reach, center[1] - reach, center[0] + reach, center[1] + reach]
    draw.pieslice(box, heading - half, heading + half, fill=(255, 244, 224, 20))
    for edge, probability in step.edge_probability.items():
        if probability > 0.02:
            alpha = round(50 + 205 * min(probability, 1.0))
            width = 6 + round(12 * probability)
            draw.line(shift(panel.edge(edge)), fill=(*_BELIEF, alpha), width=width)
    if len(trail) > 1:
        draw.line(shift(trail), fill=(255, 255, 255, 210), width=4, joint="curve")
    _disc(draw, center, 0.177 * panel.scale + 4, (*_BACKGROUND, 255))
    _disc(draw, center, 0.177 * panel.scale + 1, (*_ROBOT, 255))
    nose = (
        center[0] + 0.42 * panel.scale * math.cos(step.pose.yaw_rad),
        center[1] - 0.42 * panel.scale * math.sin(step.pose.yaw_rad),
    )
    draw.line([center, nose], fill=(*_ROBOT, 255), width=5)
    return image.reduce(_FINER)


def _write(
    frame: Image.Image,
    step: FilmStep,
    fonts: Mapping[int, ImageFont.FreeTypeFont | ImageFont.ImageFont],
    title: str,
) -> None:
    draw = ImageDraw.Draw(frame)
    left, _, width, _ = _DEPTH_BOX
    draw.text((left, 30), "What the robot sees", font=fonts[22], fill=_TEXT)
    draw.text(
        (left + width, 35), f"{step.time_s:5.1f} s", font=fonts[17], fill=_MUTED, anchor="ra"
    )
    draw.text((_PLAN_BOX[0], 30), f"Where {title} thinks it is", font=fonts[22], fill=_TEXT)
    y = 74
    if step.behavior is not None:
        color = BEHAVIOR_RGB[step.behavior]
        name = step.behavior.replace("_", " ")
        box_width = draw.textlength(name, font=fonts[17]) + 28
        draw.rounded_rectangle([left, y, left + box_width, y + 34], 17, fill=color)
        draw.text((left + 14, y + 17), name, font=fonts[17], fill=_BACKGROUND, anchor="lm")
    for x, label, place in (
        (_PLAN_BOX[0], "believes", step.believed),
        (_PLAN_BOX[0] + 320, "is at", step.true),
    ):
        color = _BELIEF if label == "believes" else _TEXT
        draw.text((x, y + 17), label, font=fonts[17], fill=_MUTED, anchor="lm")
        beside = x + draw.textlength(label, font=fonts[17]) + 10
        place = place.replace("_", " ")
        draw.text((beside, y + 17), place, font=fonts[17], fill=color, anchor="lm")


def _disc(
    draw: ImageDraw.ImageDraw,
    center: tuple[float, float],
    radius: float,
    color: tuple[int, int, int, int],
) -> None:
    x, y = center
    draw.ellipse([x - radius, y - radius, x + radius, y + radius], fill=color)


def write_film(
    path: Path,
    frames: Iterator[UInt8[np.ndarray, "height width 3"]],
    fps: float,
    size: tuple[int, int] = _SIZE,
) -> None:
    """Write the frames as an H.264 film that every browser plays.

    Args:
        path: Where to write.
        frames: Pictures of that size.
        fps: Frames a second.
        size: Width and height, multiples of 16.
    """
    writer = imageio_ffmpeg.write_frames(
        str(path),
        size,
        fps=fps,
        codec="libx264",
        quality=None,
        macro_block_size=16,
        output_params=["-crf", "22", "-preset", "veryfast", "-movflags", "+faststart"],
        ffmpeg_log_level="error",
    )
    writer.send(None)
    try:
        for frame in frames:
            writer.send(np.ascontiguousarray(frame))
    finally:
        writer.close()
