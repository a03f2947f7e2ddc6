"""Small maps for the tests of the models."""

import itertools

import numpy as np
import torch

from toponav.core.vocabulary import Behavior, NodeKind
from toponav.maps.plan import shortest_plan
from toponav.maps.spec import MapFrame, Node, TopologicalMap, edge_along
from toponav.maps.subgraph import crop
from toponav.models.graphnav.graph_tensors import encode_subgraph


def office_map() -> TopologicalMap:
    """A corridor of six places in both directions, with an office off the third."""
    kinds = NodeKind
    east = [Node(f"e{i}", kinds.HALLWAY, 4.0 * i, 0.0) for i in range(6)]
    west = [Node(f"w{i}", kinds.HALLWAY, 4.0 * i, 0.5) for i in range(6)]
    lounge = Node("lounge", kinds.OPEN_SPACE, 24.0, 0.0, "lounge")
    room = Node("office_1", kinds.ROOM, 8.0, 4.0, "office_1")
    door = Node("office_1_door", kinds.DOOR, 8.0, 2.0, "office_1")
    follow, find = Behavior.CORRIDOR_FOLLOW, Behavior.FIND_DOOR
    edges = [edge_along(a, b, follow) for a, b in itertools.pairwise(east)]
    edges += [edge_along(b, a, follow) for a, b in itertools.pairwise(west)]
    edges += [
        edge_along(east[5], lounge, Behavior.STRAIGHT),
        edge_along(lounge, west[5], find),
        edge_along(east[2], room, Behavior.TURN_LEFT),
        edge_along(west[2], room, Behavior.TURN_RIGHT),
        edge_along(room, door, find),
        edge_along(door, east[3], Behavior.TURN_LEFT),
        edge_along(door, west[1], Behavior.TURN_RIGHT),
    ]
    return TopologicalMap("office", MapFrame(), (*east, *west, lounge, room, door), tuple(edges))


def crops(config, centers=("e2", "office_1", "w1")):
    """Encoded crops around some edges."""
    topological_map = office_map()
    plan = shortest_plan(topological_map, "e0", "office_1")
    graphs = []
    for center in centers:
        edge = topological_map.out_edges(center)[0].id
        around = crop(topological_map, center, config.ahead, config.behind)
        graphs.append(encode_subgraph(topological_map, around, plan, edge, config))
    return graphs


def random_stacks(config, count, seed=0):
    """Byte frames of the configuration's size."""
    rng = np.random.default_rng(seed)
    shape = (count, len(config.frame_offsets), config.image.rows, config.image.cols)
    return torch.from_numpy(rng.integers(0, 256, shape).astype(np.uint8))
