"""A tiny training set: a corridor map whose images say which edge the robot is on."""

import numpy as np

from toponav.core.vocabulary import Behavior, NodeKind
from toponav.maps.plan import Plan, shortest_plan
from toponav.maps.spec import Edge, MapFrame, Node, TopologicalMap, edge_along

ORDER = list(Behavior)


def corridor_map(name="corridor", places=8) -> TopologicalMap:
    """A chain of places; behaviours alternate, and a turn leads back at every place."""
    nodes = [Node(f"n{i}", NodeKind.HALLWAY, 3.0 * i, 0.0) for i in range(places)]
    edges: list[Edge] = []
    for i in range(places - 1):
        edges.append(edge_along(nodes[i], nodes[i + 1], ORDER[i % len(ORDER)]))
    for i in range(1, places - 1):
        side = Node(f"s{i}", NodeKind.ROOM, 3.0 * i, 3.0)
        nodes.append(side)
        edges.append(edge_along(nodes[i], side, Behavior.TURN_LEFT))
        edges.append(edge_along(side, nodes[i], Behavior.FIND_DOOR))
    return TopologicalMap(name, MapFrame(), tuple(nodes), tuple(edges))


class SyntheticSet:
    """Trajectories along the corridor: a bright column says the behaviour and the turn rate."""

    def __init__(self, trajectories=6, frames_an_edge=12, rows=32, cols=96, buildings=3, seed=0):
        rng = np.random.default_rng(seed)
        self._maps = {f"building_{b}": corridor_map(f"building_{b}") for b in range(buildings)}
        self._building = [f"building_{t % buildings}" for t in range(trajectories)]
        frames, command, behavior, edge, trajectory = [], [], [], [], []
        position = []
        self._plans = []
        for number, building in enumerate(self._building):
            topological_map = self._maps[building]
            plan = shortest_plan(topological_map, "n0", "n7")
            self._plans.append(plan)
            for place, edge_id in enumerate(plan.edges):
                kind = ORDER.index(topological_map.edge(edge_id).behavior)
                for _ in range(frames_an_edge):
                    turn = float(rng.uniform(-1.0, 1.0))
                    image = rng.integers(0, 40, (rows, cols)).astype(np.uint8)
                    image[rows // 8 * (kind + 1) :][: rows // 8] = 255
                    column = int((turn + 1) / 2 * (cols - 9))
                    image[: rows // 8, column : column + 8] = 255
                    frames.append(image)
                    command.append((0.3, turn))
                    behavior.append(kind)
                    edge.append(topological_map.edge_index[edge_id])
                    trajectory.append(number)
                    position.append(place)
        self.frames = np.stack(frames)
        self.command = np.array(command, np.float32)
        self.executed = self.command
        self.behavior = np.array(behavior, np.int8)
        self.edge = np.array(edge, np.int32)
        self.trajectory = np.array(trajectory, np.int32)
        self.plan_position = np.array(position, np.int32)

    def map_of(self, trajectory: int) -> TopologicalMap:
        return self._maps[self._building[trajectory]]

    def plan_of(self, trajectory: int) -> Plan:
        return self._plans[trajectory]

    def building_of(self, trajectory: int) -> str:
        return self._building[trajectory]
