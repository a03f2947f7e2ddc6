"""The map that Neural Topological SLAM builds: panoramas at nodes, ghosts where none was yet."""

import io
import json
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float32, UInt8

from toponav.core.errors import InputError
from toponav.core.files import read_json_object, write_atomically
from toponav.core.geometry import Pose2, wrap_angle
from toponav.core.imagenav import DIRECTIONS, NODE_RADIUS_M, direction_of_bin

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["SCHEMA_VERSION", "GhostNode", "ImageEdge", "ImageGraph", "ImageNode"]

SCHEMA_VERSION = 1
_GRAPH = "graph.json"
_MOST_NODES = 10_000
_CELL_M = 4.0
_REMEDY = "name a folder that ImageGraph.save wrote"


@dataclass(eq=False)
class ImageNode:
    """A place that the robot has been at.

    Attributes:
        number: Its number, from 0 in the order of visits.
        pose: Where the robot believed to be, in the frame of the start.
        step: Step at which it was added.
        panorama: What it looks like from there, where kept.
        features: What the network made of that, where kept.
    """

    number: int
    pose: Pose2
    step: int
    panorama: UInt8[np.ndarray, "height width 3"] | None = None
    features: Float32[np.ndarray, "features azimuths"] | None = None


@dataclass(frozen=True)
class ImageEdge:
    """Two nodes that the robot has driven between.

    Attributes:
        source: Number of a node.
        target: Number of another.
        relative: Pose of the target in the frame of the source, from odometry.
    """

    source: int
    target: int
    relative: Pose2

    @property
    def length_m(self) -> float:
        """Straight distance between the two."""
        return math.hypot(self.relative.x_m, self.relative.y_m)


@dataclass
class GhostNode:
    """A place not seen yet, in an explorable direction of a node.

    Attributes:
        node: The one node that it hangs on.
        direction: Bin of the direction, from the node's heading.
        distance_m: How far it lies from the node.
        score: How fast the goal may be reached that way, 0..1, where scored.
        bearing_rad: Where in its direction it lies, from the node's heading; the middle where
            nothing is known.
        unseen_m2: Floor behind it that was not searched, where it is an edge of the searched
            floor; None where it is a direction that the network calls explorable.
        behind_m2: The same of the nearest such edge, where it is a direction.
    """

    node: int
    direction: int
    distance_m: float = NODE_RADIUS_M
    score: float | None = None
    bearing_rad: float | None = None
    unseen_m2: float | None = None
    behind_m2: float | None = None

    @property
    def floor_m2(self) -> float | None:
        """Floor behind it that was not searched, where that is known."""
        return self.behind_m2 if self.unseen_m2 is None else self.unseen_m2


@dataclass(eq=False)
class ImageGraph:
    """Nodes with panoramas, edges with relative poses, and ghost nodes.

    Attributes:
        nodes: In the order of visits; the number of a node is its place here.
        ghosts: Unexplored places.
    """

    nodes: list[ImageNode] = field(default_factory=list)
    ghosts: list[GhostNode] = field(default_factory=list)
    _edges: dict[tuple[int, int], ImageEdge] = field(default_factory=dict)
    _cells: dict[tuple[int, int], list[int]] = field(default_factory=dict)

    @property
    def edges(self) -> tuple[ImageEdge, ...]:
        """Every edge once."""
        return tuple(self._edges.values())

    def add_node(
        self,
        pose: Pose2,
        step: int,
        panorama: UInt8[np.ndarray, "height width 3"] | None = None,
        features: Float32[np.ndarray, "features azimuths"] | None = None,
    ) -> int:
        """The number of a new node."""
        number = len(self.nodes)
        self.nodes.append(ImageNode(number, pose, step, panorama, features))
        self._cells.setdefault(_cell_of(pose), []).append(number)
        return number

    def nodes_near(self, pose: Pose2, reach_m: float) -> list[tuple[float, int]]:
        """Distance and number of the nodes within a reach, the nearest first.

        Looks at what lies around alone: what it costs does not grow with the graph.
        """
        row, col = _cell_of(pose)
        around = math.ceil(reach_m / _CELL_M)
        found = [
            (pose.distance_to(self.nodes[number].pose), number)
            for r in range(row - around, row + around + 1)
            for c in range(col - around, col + around + 1)
            for number in self._cells.get((r, c), ())
        ]
        return sorted(one for one in found if one[0] < reach_m)

    def add_edge(self, source: int, target: int, relative: Pose2 | None = None) -> None:
        """Connects two nodes; nothing happens where they are connected or the same.

        Args:
            source: Number of a node.
            target: Number of another.
            relative: Pose of the target from the source; from their poses when left out.
        """
        if source == target or (source, target) in self._edges or (target, source) in self._edges:
            return
        if relative is None:
            relative = self.nodes[target].pose.relative_to(self.nodes[source].pose)
        self._edges[source, target] = ImageEdge(source, target, relative)

    def neighbours(self, number: int) -> list[tuple[int, float]]:
        """The nodes connected to one, each with the length of the edge."""
        found = []
        for edge in self._edges.values():
            if edge.source == number:
                found.append((edge.target, edge.length_m))
            elif edge.target == number:
                found.append((edge.source, edge.length_m))
        return found

    def pose_of_ghost(self, ghost: GhostNode) -> Pose2:
        """Where a ghost lies, in the frame of the start, heading away from its node."""
        away = self.bearing_of_ghost(ghost)
        x_m, y_m = ghost.distance_m * math.cos(away), ghost.distance_m * math.sin(away)
        return self.nodes[ghost.node].pose.compose(Pose2(x_m, y_m, away))

    def bearing_of_ghost(self, ghost: GhostNode) -> float:
        """The direction of a ghost, from its node's heading."""
        if ghost.bearing_rad is not None:
            return ghost.bearing_rad
        return direction_of_bin(ghost.direction)

    def patch_of_ghost(self, ghost: GhostNode) -> UInt8[np.ndarray, "height part 3"] | None:
        """The part of its node's panorama that looks towards a ghost."""
        panorama = self.nodes[ghost.node].panorama
        if panorama is None:
            return None
        width = panorama.shape[1]
        middle = width / 2 - direction_of_bin(ghost.direction) / (2 * math.pi) * width
        half = width / DIRECTIONS / 2
        columns = np.arange(round(middle - half), round(middle + half)) % width
        return panorama[:, columns]

    def shortest_path(self, source: int, target: int) -> list[int]:
        """The nodes from one to another, both included; empty where there is no way."""
        lengths, before = self.distances_m(source)
        if not math.isfinite(lengths[target]):
            return []
        path = [target]
        while path[-1] != source:
            path.append(before[path[-1]])
        return path[::-1]

    def distances_m(self, source: int) -> tuple[list[float], list[int]]:
        """The way from a node to each, and the node before it on that way (Dijkstra 1959)."""
        import heapq

        ways: list[list[tuple[int, float]]] = [[] for _ in self.nodes]
        for edge in self._edges.values():
            ways[edge.source].append((edge.target, edge.length_m))
            ways[edge.target].append((edge.source, edge.length_m))
        lengths = [math.inf] * len(self.nodes)
        before = [-1] * len(self.nodes)
        lengths[source] = 0.0
        front = [(0.0, source)]
        while front:
            so_far, number = heapq.heappop(front)
            if so_far > lengths[number]:
                continue
            for other, length in ways[number]:
                if so_far + length < lengths[other]:
                    lengths[other] = so_far + length
                    before[other] = number
                    heapq.heappush(front, (lengths[other], other))
        return lengths, before

    def save(self, folder: Path) -> None:
        """Writes the graph: `graph.json`, and a PNG a node for its panorama."""
        from PIL import Image

        folder.mkdir(parents=True, exist_ok=True)
        nodes = []
        for node in self.nodes:
            name = f"node_{node.number:04d}.png" if node.panorama is not None else None
            if node.panorama is not None and name is not None:
                content = io.BytesIO()
                Image.fromarray(node.panorama).save(content, "PNG")
                write_atomically(folder / name, content.getvalue())
            nodes.append({"pose": list(node.pose), "step": node.step, "panorama": name})
        document = {
            "schema": SCHEMA_VERSION,
            "nodes": nodes,
            "edges": [
                {"source": edge.source, "target": edge.target, "relative": list(edge.relative)}
                for edge in self.edges
            ],
            "ghosts": [
                {
                    "node": ghost.node,
                    "direction": ghost.direction,
                    "distance_m": ghost.distance_m,
                    "score": ghost.score,
                    "bearing_rad": ghost.bearing_rad,
                    "unseen_m2": ghost.unseen_m2,
                }
                for ghost in self.ghosts
            ],
        }
        text = json.dumps(document, indent=1, allow_nan=False) + "\n"
        write_atomically(folder / _GRAPH, text.encode())

    @staticmethod
    def load(folder: Path) -> "ImageGraph":
        """What `save` wrote; features are not stored, a network makes them again.

        Raises:
            InputError: A file is missing or broken.
        """
        document = read_json_object(folder / _GRAPH)
        if document.get("schema") != SCHEMA_VERSION:
            raise _broken(folder, f"schema has to be {SCHEMA_VERSION}")
        graph = ImageGraph()
        try:
            _read_parts(graph, document, folder)
        except (KeyError, TypeError, ValueError, OverflowError) as error:
            raise _broken(folder, f"it is not an image graph: {error}") from None
        return graph

    def draw(self) -> "Figure":
        """The graph from above; ghosts are coloured by their scores."""
        from matplotlib.figure import Figure

        figure = Figure(figsize=(7, 7), layout="constrained")
        axes = figure.add_subplot()
        for edge in self.edges:
            one, other = self.nodes[edge.source].pose, self.nodes[edge.target].pose
            axes.plot([one.x_m, other.x_m], [one.y_m, other.y_m], color="0.5", zorder=1)
        for ghost in self.ghosts:
            one, other = self.nodes[ghost.node].pose, self.pose_of_ghost(ghost)
            axes.plot([one.x_m, other.x_m], [one.y_m, other.y_m], ":", color="0.7", zorder=1)
        places = [self.pose_of_ghost(ghost) for ghost in self.ghosts]
        if places:
            scores = [ghost.score or 0.0 for ghost in self.ghosts]
            x_m, y_m = [p.x_m for p in places], [p.y_m for p in places]
            axes.scatter(x_m, y_m, c=scores, marker="s", cmap="viridis", zorder=2, label="ghosts")
        x_m, y_m = [n.pose.x_m for n in self.nodes], [n.pose.y_m for n in self.nodes]
        axes.scatter(x_m, y_m, color="tab:blue", s=60, zorder=3, label="nodes")
        for node in self.nodes:
            axes.annotate(str(node.number), (node.pose.x_m, node.pose.y_m), zorder=4)
        axes.set_aspect("equal")
        axes.set_xlabel("x (m)")
        axes.set_ylabel("y (m)")
        axes.legend(loc="upper right")
        return figure


def _broken(folder: Path, rule: str) -> InputError:
    return InputError(rule, where=str(folder / _GRAPH), remedy=_REMEDY)


def _read_parts(graph: ImageGraph, document: dict[str, object], folder: Path) -> None:
    nodes, edges, ghosts = (_list(document[name]) for name in ("nodes", "edges", "ghosts"))
    if max(len(nodes), len(edges), len(ghosts)) > _MOST_NODES * DIRECTIONS:
        raise ValueError("too many nodes")
    for record in nodes:
        name = record["panorama"]
        panorama = None if name is None else _read_panorama(folder, str(name))
        graph.add_node(_pose(record["pose"]), int(record["step"]), panorama)
    for record in edges:
        source, target = (_number(record[end], len(nodes)) for end in ("source", "target"))
        graph.add_edge(source, target, _pose(record["relative"]))
    for record in ghosts:
        score, bearing_rad = record["score"], record.get("bearing_rad")
        unseen_m2 = record.get("unseen_m2")
        graph.ghosts.append(
            GhostNode(
                _number(record["node"], len(nodes)),
                _number(record["direction"], DIRECTIONS),
                float(record["distance_m"]),
                None if score is None else float(score),
                None if bearing_rad is None else wrap_angle(float(bearing_rad)),
                None if unseen_m2 is None else float(unseen_m2),
            )
        )


def _cell_of(pose: Pose2) -> tuple[int, int]:
    """Row and column of the cell in which a node is looked up."""
    return math.floor(pose.y_m / _CELL_M), math.floor(pose.x_m / _CELL_M)


def _list(value: object) -> list[dict[str, Any]]:
    if not isinstance(value, list) or not all(isinstance(item, dict) for item in value):
        raise TypeError("nodes, edges and ghosts have to be lists of objects")
    return value


def _number(value: object, count: int) -> int:
    if not isinstance(value, int) or not 0 <= value < count:
        raise ValueError(f"{value!r} has to be 0..{count - 1}")
    return value


def _pose(value: object) -> Pose2:
    if not isinstance(value, list) or len(value) != 3:
        raise ValueError("a pose is [x, y, yaw]")
    x_m, y_m, yaw_rad = map(float, value)
    if not all(map(math.isfinite, (x_m, y_m, yaw_rad))):
        raise ValueError("poses have to be finite")
    return Pose2(x_m, y_m, wrap_angle(yaw_rad))


def _read_panorama(folder: Path, name: str) -> UInt8[np.ndarray, "height width 3"]:
    from PIL import Image

    if Path(name).name != name:
        raise ValueError(f"{name!r} has to be a file beside it")
    try:
        with Image.open(folder / name, formats=["PNG"]) as image:
            if image.width * image.height > 1 << 24:
                raise ValueError(f"{name} is too large")
            return np.asarray(image.convert("RGB"))
    except OSError as error:
        raise ValueError(f"{name} cannot be read: {error}") from None
