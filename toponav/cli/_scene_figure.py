"""The picture that `toponav scene show` draws: plan, views, panorama, credits."""

import dataclasses
import math
import textwrap
from importlib.util import find_spec
from typing import TYPE_CHECKING

import numpy as np

from toponav.core.camera import Camera, PanoramaCamera, PinholeCamera
from toponav.core.errors import InputError
from toponav.core.geometry import Pose2

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from toponav.worlds.scene import Scene

__all__ = ["scene_figure", "view_poses"]

_VIEW = PinholeCamera(width=480, height=360, hfov_rad=math.radians(85.0))
_PANORAMA = PanoramaCamera(height=256, width=1024)
_EYE_M = 1.2
_WIDTH_IN, _VIEWS_PER_ROW = 9.0, 4
_MOST_CREDITS = 12


def scene_figure(scene: "Scene", views: int) -> "Figure":
    """The plan, colour views from where it shows numbers, a panorama, and whose work is in it.

    Args:
        scene: The building.
        views: How many views; none and no panorama for 0.
    """
    from matplotlib.figure import Figure

    from toponav.worlds.draw import draw_plan

    poses = view_poses(scene, views)
    per_row = min(max(len(poses), 1), _VIEWS_PER_ROW)
    view_rows = math.ceil(len(poses) / per_row)
    heights = [min(_WIDTH_IN * scene.grid.rows / scene.grid.cols, 14.0)]
    heights += [0.75 * _WIDTH_IN / per_row + 0.25] * view_rows
    heights += [_WIDTH_IN / 4 + 0.25] if poses else []
    figure = Figure(figsize=(_WIDTH_IN, sum(heights)), layout="constrained")
    grid = figure.add_gridspec(len(heights), per_row, height_ratios=heights)
    plan = figure.add_subplot(grid[0, :])
    draw_plan(plan, scene)
    plan.set_title(scene.name)
    for number, pose in enumerate(poses):
        _mark(plan, number + 1, pose)
        ax = figure.add_subplot(grid[1 + number // per_row, number % per_row])
        _draw_view(ax, scene, _VIEW, pose)
        ax.set_title(f"{number + 1}: {scene.room_at(pose.x_m, pose.y_m) or ''}", fontsize=7)
    if poses:
        ax = figure.add_subplot(grid[-1, :])
        _draw_view(ax, scene, _PANORAMA, _middle(scene, poses[0]))
        name = scene.room_at(poses[0].x_m, poses[0].y_m)
        ax.set_title(f"{name} all around: backwards, left, forward, right, backwards", fontsize=7)
    if scene.attribution:
        figure.supxlabel(_credits(scene), fontsize=5, x=0.01, ha="left")
    return figure


def _draw_view(ax: "Axes", scene: "Scene", camera: Camera, pose: Pose2) -> None:
    """What a camera sees, in colour where rays can be cast and else as depth."""
    from toponav.sim.render.make import make_renderer

    height_m = min(_EYE_M, 0.6 * scene.ceiling_m)
    renderer = make_renderer(scene, dataclasses.replace(camera, mount_height_m=height_m))
    if find_spec("embreex") is None:
        ax.imshow(renderer.render(pose), cmap="viridis_r", vmin=0, vmax=camera.max_depth_m)
    else:
        rgb = renderer.render_images(pose, ("rgb",)).rgb
        assert rgb is not None
        ax.imshow(rgb)
    ax.set_axis_off()


def _mark(plan: "Axes", number: int, pose: Pose2) -> None:
    """A number on the plan and an arrow the way that the view looks."""
    plan.annotate(
        f"{number}",
        (pose.x_m, pose.y_m),
        color="#b03020",
        fontsize=8,
        ha="center",
        va="center",
        bbox={"boxstyle": "circle,pad=0.15", "fc": "white", "ec": "#b03020", "lw": 0.8},
    )
    ahead = pose.compose(pose._replace(x_m=1.2, y_m=0.0, yaw_rad=0.0))
    plan.annotate(
        "",
        (ahead.x_m, ahead.y_m),
        (pose.x_m, pose.y_m),
        arrowprops={"arrowstyle": "->", "color": "#b03020"},
    )


def _credits(scene: "Scene") -> str:
    """Whose work is in the scene, a line each, shortened where there are many."""
    lines = [
        textwrap.shorten(f"{entry.work}: {entry.creator}, {entry.licence}", 120)
        for entry in scene.attribution[:_MOST_CREDITS]
    ]
    more = len(scene.attribution) - len(lines)
    return "\n".join([*lines, *([f"and {more} more"] if more else [])])


def view_poses(scene: "Scene", views: int) -> list[Pose2]:
    """A pose in each of the largest rooms: far from its middle, and looking there."""
    from toponav.worlds.draw import room_anchors_m
    from toponav.worlds.free_space import FreeSpace

    anchors = room_anchors_m(scene)
    free = FreeSpace.of(scene, 0.2).free
    sizes = np.bincount(scene.room_index[scene.room_index >= 0], minlength=len(scene.rooms))
    poses: list[Pose2] = []
    for number in np.argsort(-sizes, kind="stable"):
        cells = np.argwhere(free & (scene.room_index == number))
        if len(poses) >= views or not len(cells):
            continue
        origin_m = np.array(scene.grid.center_of(0, 0))
        places_m = origin_m + cells[:, ::-1] * scene.grid.resolution_m
        x_m, y_m = places_m[np.square(places_m - anchors[number]).sum(axis=1).argmax()].tolist()
        ahead_x_m, ahead_y_m = (anchors[number] - (x_m, y_m)).tolist()
        poses.append(Pose2(x_m, y_m, math.atan2(ahead_y_m, ahead_x_m)))
    return poses


def _middle(scene: "Scene", pose: Pose2) -> Pose2:
    """The pose moved on into the middle of its room."""
    from toponav.worlds.draw import room_anchors_m
    from toponav.worlds.free_space import FreeSpace

    number = scene.room_number(scene.room_at(pose.x_m, pose.y_m) or "")
    middle_x_m, middle_y_m = room_anchors_m(scene)[number].tolist()
    space = FreeSpace.of(scene, 0.2)
    try:
        x_m, y_m = scene.grid.center_of(*space.nearest_free(middle_x_m, middle_y_m, within_m=3.0))
    except InputError:
        return pose
    return Pose2(x_m, y_m, pose.yaw_rad)
