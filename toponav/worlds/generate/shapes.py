"""Builds small meshes from boxes, prisms and turned profiles: what parametric furniture is of."""

import itertools
import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float64, Int32

__all__ = ["Number", "Point", "Shape", "ShapeBuilder", "Span", "turned"]

Number = float | int
Span = tuple[Number, Number]
Point = tuple[Number, Number, Number]

_BOX_QUADS = np.array(
    [[4, 5, 6, 7], [0, 3, 2, 1], [0, 1, 5, 4], [2, 3, 7, 6], [3, 0, 4, 7], [1, 2, 6, 5]]
)  # up, down, -y, +y, -x, +x; counter-clockwise from outside
_AXES_OF_FACE = ((0, 1), (0, 1), (0, 2), (0, 2), (1, 2), (1, 2))


@dataclass(frozen=True, eq=False)
class Shape:
    """Triangles whose surfaces are named, not chosen yet.

    Attributes:
        corners_m: The three corners of each triangle, counter-clockwise from outside.
        corner_uv: Texture places of the corners: metres, or repeats for pictures.
        slot: Index into `slots` of each triangle.
        slots: Kind of surface of each part, such as `wood` or `fabric`.
    """

    corners_m: Float64[np.ndarray, "faces 3 3"]
    corner_uv: Float64[np.ndarray, "faces 3 2"]
    slot: Int32[np.ndarray, " faces"]
    slots: tuple[str, ...]

    @property
    def size_m(self) -> tuple[float, float, float]:
        """Width, depth and height of the box around it."""
        points = self.corners_m.reshape(-1, 3)
        x, y, z = np.ptp(points, axis=0)
        return float(x), float(y), float(z)


def turned(angle_rad: Number) -> Float64[np.ndarray, "3 3"]:
    """The matrix that turns points about the z axis."""
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


class ShapeBuilder:
    """Collects primitives; x runs to the right, y from the back to the front, z up, in metres."""

    def __init__(self) -> None:
        self._corners: list[np.ndarray] = []
        self._uv: list[np.ndarray] = []
        self._slot: list[np.ndarray] = []
        self._slots: list[str] = []

    @property
    def mark(self) -> int:
        """The number of primitives so far, for `turn_since`."""
        return len(self._corners)

    def finish(self) -> Shape:
        """The shape as it was built."""
        return Shape(
            np.concatenate(self._corners),
            np.concatenate(self._uv),
            np.concatenate(self._slot).astype(np.int32),
            tuple(self._slots),
        )

    def turn_since(self, mark: int, axis: int, angle_rad: Number, about: Point) -> None:
        """Turns all primitives made since a mark about an axis through a point."""
        c, s = math.cos(angle_rad), math.sin(angle_rad)
        one, two = ((1, 2), (2, 0), (0, 1))[axis]
        matrix = np.eye(3)
        matrix[one, one] = matrix[two, two] = c
        matrix[one, two], matrix[two, one] = -s, s
        center = np.array(about)
        for at in range(mark, len(self._corners)):
            self._corners[at] = (self._corners[at] - center) @ matrix.T + center

    def move_since(self, mark: int, by: Point) -> None:
        """Shifts all primitives made since a mark."""
        for at in range(mark, len(self._corners)):
            self._corners[at] = self._corners[at] + np.array(by)

    def quads(
        self,
        points: Float[np.ndarray, "quads 4 3"],
        uv: Float[np.ndarray, "quads 4 2"],
        surface: str,
    ) -> None:
        """Flat four-cornered faces, counter-clockwise seen from outside."""
        self._add(points[:, [0, 1, 2, 0, 2, 3]], uv[:, [0, 1, 2, 0, 2, 3]], surface)

    def _add(self, points: np.ndarray, uv: np.ndarray, surface: str) -> None:
        if surface not in self._slots:
            self._slots.append(surface)
        triangles = np.asarray(points, np.float64).reshape(-1, 3, 3)
        self._corners.append(triangles)
        self._uv.append(np.asarray(uv, np.float64).reshape(-1, 3, 2))
        self._slot.append(np.full(len(triangles), self._slots.index(surface)))

    def box(
        self,
        x: Span,
        y: Span,
        z: Span,
        surface: str,
        *,
        front: str | None = None,
        bottom: bool = True,
    ) -> None:
        """A box between three pairs of bounds; `front` is another surface for its +y side."""
        (x0, x1), (y0, y1), (z0, z1) = x, y, z
        base = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])
        eight = np.concatenate(
            [np.column_stack([base, np.full(4, z0)]), np.column_stack([base, np.full(4, z1)])]
        )
        points = eight[_BOX_QUADS]
        uv = np.stack([points[n][:, list(axes)] for n, axes in enumerate(_AXES_OF_FACE)])
        keep = [0, 1, 2, 3, 4, 5] if bottom else [0, 2, 3, 4, 5]
        if front is not None:
            keep.remove(3)
            self.quads(points[3:4], uv[3:4], front)
        self.quads(points[keep], uv[keep], surface)

    def panel(self, x: Span, z: Span, y: float, surface: str) -> None:
        """An upright picture that faces +y and shows its texture once."""
        (x0, x1), (z0, z1) = x, z
        points = np.array([[x1, y, z0], [x0, y, z0], [x0, y, z1], [x1, y, z1]])
        uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)
        self.quads(points[None], uv[None], surface)

    def prism(
        self,
        outline: Float[np.ndarray, "corners 2"],
        z: Span,
        surface: str,
        *,
        top: Float[np.ndarray, "corners 2"] | None = None,
        caps: bool = True,
        bottom: bool = True,
    ) -> None:
        """A convex outline, counter-clockwise, raised to another (or the same) one."""
        upper = outline if top is None else top
        low = np.column_stack([outline, np.full(len(outline), z[0])])
        high = np.column_stack([upper, np.full(len(outline), z[1])])
        after = np.roll(np.arange(len(outline)), -1)
        steps = np.linalg.norm(outline[after] - outline, axis=1)
        along = np.concatenate([[0.0], np.cumsum(steps)])
        slant = float(np.hypot(np.linalg.norm(upper - outline, axis=1).mean(), z[1] - z[0]))
        points = np.stack([low, low[after], high[after], high], axis=1)
        uv = np.zeros((len(outline), 4, 2))
        uv[:, [0, 3], 0], uv[:, [1, 2], 0] = along[:-1, None], along[1:, None]
        uv[:, 2:, 1] = slant
        self.quads(points, uv, surface)
        if caps:
            self._fan(high, surface)
            if bottom:
                self._fan(low[::-1], surface)

    def _fan(self, ring: np.ndarray, surface: str) -> None:
        """A flat convex face."""
        count = len(ring)
        index = np.column_stack(
            [np.zeros(count - 2, int), np.arange(1, count - 1), np.arange(2, count)]
        )
        self._add(ring[index], ring[index][..., :2], surface)

    def soft(
        self,
        x: Span,
        y: Span,
        z: Span,
        surface: str,
        radius: Number = 0.05,
    ) -> None:
        """A cushion: a box with cut vertical edges and a bevelled top."""
        (x0, x1), (y0, y1), (z0, z1) = x, y, z
        r = min(radius, (x1 - x0) / 3, (y1 - y0) / 3, (z1 - z0) * 0.8)

        def ring(inset: Number) -> np.ndarray:
            a0, a1, b0, b1 = x0 + inset, x1 - inset, y0 + inset, y1 - inset
            c = r * 0.7
            return np.array(
                [
                    (a0 + c, b0), (a1 - c, b0), (a1, b0 + c), (a1, b1 - c),
                    (a1 - c, b1), (a0 + c, b1), (a0, b1 - c), (a0, b0 + c),
                ]
            )  # fmt: skip

        self.prism(ring(0.0), (z0, z1 - r * 0.8), surface, caps=False)
        self.prism(ring(0.0), (z1 - r * 0.8, z1), surface, top=ring(r * 0.7), bottom=False)
        self._fan(np.column_stack([ring(0.0), np.full(8, z0)])[::-1], surface)

    def cylinder(
        self,
        center: Span,
        z: Span,
        radius: Number,
        surface: str,
        *,
        top_radius: Number | None = None,
        sides: int = 10,
        caps: bool = True,
    ) -> None:
        """An upright cylinder or cone."""
        ring = _ring(sides)
        upper = radius if top_radius is None else top_radius
        middle = np.array(center)
        self.prism(middle + ring * radius, z, surface, top=middle + ring * upper, caps=caps)

    def bar(
        self,
        start: Point,
        end: Point,
        radius: Number,
        surface: str,
        sides: int = 6,
    ) -> None:
        """A round bar between two points."""
        a, b = np.array(start), np.array(end)
        axis = (b - a) / np.linalg.norm(b - a)
        side = np.cross(axis, (0.0, 0.0, 1.0) if abs(axis[2]) < 0.9 else (1.0, 0.0, 0.0))
        side /= np.linalg.norm(side)
        other = np.cross(axis, side)
        ring = _ring(sides) * radius
        low = a + ring[:, :1] * side + ring[:, 1:] * other
        high = low + (b - a)
        after = np.roll(np.arange(sides), -1)
        points = np.stack([low, low[after], high[after], high], axis=1)
        uv = np.zeros((sides, 4, 2))
        uv[:, 2:, 1] = np.linalg.norm(b - a)
        uv[:, :, 0] = np.arange(sides)[:, None] * radius
        self.quads(points, uv, surface)
        self._fan(high, surface)
        self._fan(low[::-1], surface)

    def lathe(
        self,
        center: Span,
        profile: list[Span],
        surface: str,
        sides: int = 12,
        stretch: Span = (1.0, 1.0),
    ) -> None:
        """A profile of (radius, height) turned about an upright axis; `stretch` makes ovals."""
        ring = _ring(sides) * np.array(stretch)
        middle = np.array(center)
        for (r0, z0), (r1, z1) in itertools.pairwise(profile):
            low = np.column_stack([middle + ring * r0, np.full(sides, z0)])
            high = np.column_stack([middle + ring * r1, np.full(sides, z1)])
            after = np.roll(np.arange(sides), -1)
            points = np.stack([low, low[after], high[after], high], axis=1)
            uv = np.zeros((sides, 4, 2))
            uv[:, [0, 3], 0] = np.arange(sides)[:, None] * 0.1
            uv[:, [1, 2], 0] = np.arange(1, sides + 1)[:, None] * 0.1
            uv[:, :2, 1], uv[:, 2:, 1] = z0, z1 + abs(r1 - r0)
            self.quads(points, uv, surface)

    def legs(
        self,
        x: Span,
        y: Span,
        height: Number,
        surface: str,
        *,
        thick: Number = 0.05,
        is_round: bool = False,
        splay: Number = 0.0,
        bottom: Number = 0.0,
    ) -> None:
        """Four legs at the corners of a rectangle; `splay` leans them outwards."""
        for cx, sx in ((x[0], -1), (x[1], 1)):
            for cy, sy in ((y[0], -1), (y[1], 1)):
                foot = (cx + sx * splay, cy + sy * splay, bottom)
                if is_round or splay:
                    self.bar(foot, (cx, cy, height), thick / 2, surface)
                else:
                    half = thick / 2
                    self.box(
                        (cx - half, cx + half), (cy - half, cy + half), (bottom, height), surface
                    )


def _ring(sides: int) -> np.ndarray:
    """Points on a unit circle, counter-clockwise."""
    angles = 2 * np.pi * (np.arange(sides) + 0.5) / sides
    return np.column_stack([np.cos(angles), np.sin(angles)])
