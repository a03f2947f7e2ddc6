"""Draws docs/images/homes.png and offices.png: plans and first-person views of twelve of each.

Example: python benchmarks/contact_sheets.py --out docs/images
"""

import argparse
import io
import math
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from jaxtyping import UInt8
from PIL import Image, ImageDraw

from toponav.core.camera import PinholeCamera
from toponav.core.files import write_atomically
from toponav.core.geometry import Pose2
from toponav.core.vocabulary import RoomKind
from toponav.sim.render import make_renderer
from toponav.worlds.draw import plan_image
from toponav.worlds.free_space import FreeSpace
from toponav.worlds.generate.home import generate_home
from toponav.worlds.generate.office import generate_office
from toponav.worlds.scene import Scene

_PLAN_PX, _VIEW_PX, _GAP_PX, _COLUMNS = 236, (232, 174), 6, 3
_MAX_COLORS = 256
_CAMERA = PinholeCamera(
    width=_VIEW_PX[0],
    height=_VIEW_PX[1],
    hfov_rad=math.radians(90.0),
    mount_height_m=1.25,
    max_depth_m=12.0,
)
_SHOWN = (
    RoomKind.LIVING_ROOM,
    RoomKind.KITCHEN,
    RoomKind.BEDROOM,
    RoomKind.BATHROOM,
    RoomKind.DINING_ROOM,
    RoomKind.STUDY,
    RoomKind.OFFICE,
    RoomKind.HALLWAY,
    RoomKind.CONFERENCE_ROOM,
    RoomKind.LOUNGE,
)


def main() -> int:
    """Draws both sheets."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("docs/images"))
    parser.add_argument("--count", type=int, default=12)
    parser.add_argument("--views", type=int, default=2)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    makers: dict[str, Callable[[int], Scene]] = {
        "homes": generate_home,
        "offices": generate_office,
    }
    for name, make in makers.items():
        cells = [_cell(make(seed), seed, options.views) for seed in range(options.count)]
        print(_save(_sheet(cells), options.out / f"{name}.png"))
    return 0


def _cell(scene: Scene, number: int, views: int) -> Image.Image:
    """One building: its plan and some views."""
    width = _PLAN_PX + views * (_VIEW_PX[0] + _GAP_PX)
    cell = Image.new("RGB", (width, _PLAN_PX + 16), "white")
    plan = Image.fromarray(plan_image(scene)[::-1])
    scale = _PLAN_PX / max(plan.size)
    plan = plan.resize((max(1, int(plan.width * scale)), max(1, int(plan.height * scale))))
    cell.paste(plan, ((_PLAN_PX - plan.width) // 2, 16 + (_PLAN_PX - plan.height) // 2))
    draw = ImageDraw.Draw(cell)
    side_m = max(scene.grid.shape) * scene.grid.resolution_m
    draw.text((4, 1), f"{scene.name}: {len(scene.rooms)} rooms, {side_m:.0f} m", fill="#3a4148")
    for place, (title, image) in enumerate(_views(scene, number, views)):
        left = _PLAN_PX + _GAP_PX + place * (_VIEW_PX[0] + _GAP_PX)
        cell.paste(Image.fromarray(image), (left, 16 + (_PLAN_PX - _VIEW_PX[1]) // 2))
        draw.text((left, 16 + (_PLAN_PX + _VIEW_PX[1]) // 2 + 2), title, fill="#3a4148")
    return cell


def _views(
    scene: Scene, number: int, views: int
) -> list[tuple[str, UInt8[np.ndarray, "height width 3"]]]:
    """Colour images from rooms of different kinds, where most is to be seen."""
    renderer = make_renderer(scene, _CAMERA)
    space = FreeSpace.of(scene, 0.2)
    rng = np.random.default_rng(number)
    order = [_SHOWN[(number + step) % len(_SHOWN)] for step in range(len(_SHOWN))]
    rooms = sorted(
        range(len(scene.rooms)),
        key=lambda index: (
            order.index(scene.rooms[index].kind) if scene.rooms[index].kind in order else 99
        ),
    )
    images: list[tuple[str, UInt8[np.ndarray, "height width 3"]]] = []
    seen: set[RoomKind] = set()
    for index in rooms:
        kind = scene.rooms[index].kind
        cells = np.argwhere(space.free & (scene.room_index == index))
        if kind in seen or len(cells) < 20 or len(images) == views:
            continue
        seen.add(kind)
        pose = max(_poses(scene, cells, rng), key=lambda p: _openness(renderer.render(p)))
        rgb = renderer.render_images(pose, modalities=("rgb",)).rgb
        assert rgb is not None
        images.append((scene.rooms[index].name, rgb))
    return images


def _poses(scene: Scene, cells: np.ndarray, rng: np.random.Generator) -> list[Pose2]:
    """Places along the edges of a room that look towards its middle."""
    middle = cells.mean(axis=0)
    far = cells[np.argsort(-((cells - middle) ** 2).sum(axis=1))[: max(len(cells) // 3, 1)]]
    poses = []
    for row, col in far[rng.integers(len(far), size=6)].tolist():
        x_m, y_m = scene.grid.center_of(row, col)
        to_x, to_y = scene.grid.center_of(*(int(value) for value in middle))
        poses.append(Pose2(x_m, y_m, math.atan2(to_y - y_m, to_x - x_m)))
    return poses


def _openness(depth_m: np.ndarray) -> float:
    """Much to see, and nothing right before the lens."""
    return float(np.median(depth_m)) + 2.0 * float(np.percentile(depth_m, 10))


def _sheet(cells: Sequence[Image.Image]) -> Image.Image:
    """All cells in rows."""
    wide, tall = cells[0].width + 2 * _GAP_PX, cells[0].height + _GAP_PX
    rows = math.ceil(len(cells) / _COLUMNS)
    sheet = Image.new("RGB", (_COLUMNS * wide, rows * tall), "white")
    for place, cell in enumerate(cells):
        sheet.paste(cell, (place % _COLUMNS * wide, place // _COLUMNS * tall))
    return sheet


def _save(sheet: Image.Image, path: Path) -> str:
    """The file written, with few colours to stay small."""
    buffer = io.BytesIO()
    few = sheet.quantize(_MAX_COLORS, dither=Image.Dither.FLOYDSTEINBERG)
    few.save(buffer, "PNG", optimize=True)
    write_atomically(path, buffer.getvalue())
    return f"{path}: {len(buffer.getvalue()) / 1e6:.2f} MB"


if __name__ == "__main__":
    sys.exit(main())
