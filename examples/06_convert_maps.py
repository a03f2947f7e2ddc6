"""A map for every tool: draw one, write it in five formats, read it back, and see what was lost.

python examples/06_convert_maps.py
"""

import tempfile
from pathlib import Path

from toponav.core.vocabulary import Behavior, NodeKind
from toponav.maps.formats.convert import export_map, import_map
from toponav.maps.spec import MapFrame, Node, TopologicalMap, edge_along
from toponav.maps.suggest_behaviors import suggest_behaviors


def drawn_map() -> TopologicalMap:
    """A corridor past an office, its behaviours suggested by its geometry."""
    nodes = (
        Node("hallway_west", NodeKind.HALLWAY, 0.0, 0.0),
        Node("hallway_east", NodeKind.HALLWAY, 4.0, 0.0),
        Node("hallway_end", NodeKind.HALLWAY, 9.0, 0.0),
        Node("office_1", NodeKind.ROOM, 5.0, 3.0, "office_1"),
        Node("office_1_door", NodeKind.DOOR, 5.0, 1.5, "office_1"),
    )
    walks = ((0, 1), (1, 2), (1, 3), (3, 4), (4, 2))
    edges = tuple(edge_along(nodes[i], nodes[j], Behavior.STRAIGHT) for i, j in walks)
    return suggest_behaviors(TopologicalMap("example", MapFrame(), nodes, edges))


def main() -> None:
    """Write, read back, compare, and print the losses."""
    drawn = drawn_map()
    for edge in drawn.edges:
        print(f"{edge.id:<32} {edge.behavior}")
    with tempfile.TemporaryDirectory() as folder:
        for name in ("a.topo.json", "a.geojson", "a.tmap2", "a.graphml", "a.lif.json"):
            path = Path(folder) / name
            losses = export_map(drawn, path)
            if name == "a.lif.json":
                print(f"{name}: written only")
            else:
                assert import_map(path).map == drawn
                print(f"{name}: comes back as it was")
            for loss in losses:
                print(f"  {loss}")


if __name__ == "__main__":
    main()
