"""Make a building, draw its topological map, check it, and plan on it.

python examples/02_read_and_plan_on_a_map.py
"""

import tempfile
from pathlib import Path

from matplotlib.figure import Figure

from toponav.maps.construct import map_from_layout
from toponav.maps.draw import draw_floor, draw_map
from toponav.maps.plan import shortest_plan
from toponav.maps.spec import load_map, save_map
from toponav.maps.validate import validate
from toponav.worlds.generate.office import generate_office


def main(out: Path) -> None:
    scene = generate_office(7, size="small")
    save_map(map_from_layout(scene), out / "office.topo.json")

    # A map is a JSON file: nodes are places, edges are behaviours that lead between them.
    office = load_map(out / "office.topo.json")
    print(f"{office.name}: {len(office.nodes)} nodes, {len(office.edges)} edges")

    # Every fault at once, each with its place and its remedy. There should be none.
    for fault in validate(office):
        print(fault.element, fault.message, fault.remedy)

    # Each room has one node of its own name.
    rooms = [node.id for node in office.nodes if node.id == node.room]
    plan = shortest_plan(office, rooms[0], rooms[-1])
    for node, behavior in zip(plan.nodes, plan.behaviors(office), strict=False):
        print(f"  at {node}: {behavior}")
    print(f"  at {plan.nodes[-1]}: there ({plan.length_m(office):.0f} m)")

    figure = Figure(figsize=(10, 8))
    axes = figure.add_subplot()
    draw_floor(axes, scene.occupied, scene.grid.origin_m, scene.grid.resolution_m)
    draw_map(axes, office, plan)
    figure.savefig(out / "office.png", dpi=120)
    print(f"drawn: {out / 'office.png'}")


if __name__ == "__main__":
    main(Path(tempfile.mkdtemp(prefix="toponav-")))
