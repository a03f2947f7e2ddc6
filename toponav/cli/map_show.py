"""`toponav map show` and `toponav map plan`: a map as a figure, and the ways through it."""

import json
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from toponav.cli._map_files import Json, MapPath, NodeId, floor_of, load_any_map, load_building
from toponav.core.errors import InputError
from toponav.core.files import check_out_file

if TYPE_CHECKING:
    from toponav.maps.plan import Plan
    from toponav.maps.spec import TopologicalMap

__all__ = ["describe", "plan", "show"]

_IMAGES = (".png", ".pdf", ".svg", ".jpg")
_MOST_PLANS = 1000
_SOME_PLANS = 10
_DOTS_PER_INCH = 200


def show(
    map: MapPath,
    out: Path = Path("map.png"),
    scene: Path | None = None,
    start: str | None = None,
    goal: str | None = None,
    width_in: float = 10.0,
    title: str | None = None,
    as_json: Json = False,
) -> int:
    """Describe a map and draw it to scale, over the floor plan where that is known.

    PDF and SVG files are for print: lines and names are vectors, texts stay texts.

    Example: toponav map show area_3.topo.json --out area_3.pdf --start office_5 --goal WC_2

    Args:
        map: A `*.topo.json`, or the yaml of a Stanford area.
        out: Image to write, PNG, PDF, SVG or JPG.
        scene: Building to draw it over; default the floor plan that the map names.
        start: Node to start a plan from, to mark it.
        goal: Node that the plan leads to.
        width_in: Width of the figure in inches.
        title: Title of the figure; the map's name by default.
        as_json: Print the description as JSON.
    """
    from toponav.maps.plan import shortest_plan

    if out.suffix.lower() not in _IMAGES:
        raise InputError(
            f"the image must be PNG, PDF, SVG or JPG, got '{out.suffix}'",
            where="--out",
            remedy="name a file such as map.png",
        )
    check_out_file(out)
    if (start is None) != (goal is None):
        raise InputError(
            "a plan has a start and a goal, got one of them",
            where="--start, --goal",
            remedy="give both or neither",
        )
    if not 3.0 <= width_in <= 50.0:
        raise InputError(
            f"a figure is 3 to 50 inches wide, got {width_in:g}",
            where="--width-in",
            remedy="7 fits a page of two columns, 3.5 one column",
        )
    shown = load_any_map(map)
    walk = None if start is None or goal is None else shortest_plan(shown, start, goal)
    _draw(shown, walk, out, scene, map, width_in, title)
    return describe(shown, out, as_json)


def plan(
    map: MapPath,
    start: NodeId,
    goal: NodeId,
    all: bool = False,
    k: Annotated[int | None, tyro.conf.arg(aliases=["-k"])] = None,
    as_json: Json = False,
) -> int:
    """Print the plan with the fewest behaviours from one node to another, or several.

    Example: toponav map plan area_3.topo.json office_5 WC_2 -k 3

    Args:
        map: A `*.topo.json`, or the yaml of a Stanford area.
        start: Node to start from; rooms have a node of their name.
        goal: Node to reach.
        all: Print every plan without loops, the shortest first, up to 10 or -k.
        k: Print so many of the shortest plans.
        as_json: Print the plan as JSON; several as a list.
    """
    from toponav.maps.plan import shortest_plans

    if k is not None and not 1 <= k <= _MOST_PLANS:
        raise InputError(
            f"the number of plans must lie in 1..{_MOST_PLANS}, got {k}",
            where="-k",
            remedy="ask for the plans that you mean to look at",
        )
    loaded = load_any_map(map)
    count = k if k is not None else _SOME_PLANS if all else 1
    walks = shortest_plans(loaded, start, goal, count)
    several = all or k is not None
    if as_json:
        documents = [_document(loaded, walk) for walk in walks]
        print(json.dumps(documents if several else documents[0], indent=1))
        return 0
    for number, walk in enumerate(walks, start=1):
        _print_plan(loaded, walk, f"plan {number} of {len(walks)}: " if several else "")
    return 0


def describe(made: "TopologicalMap", out: Path, as_json: bool) -> int:
    """Prints what a map holds and where it was written; the exit status."""
    behaviors = Counter(edge.behavior.value for edge in made.edges)
    kinds = Counter(node.kind.value for node in made.nodes)
    document = {
        "map": made.name,
        "wrote": str(out),
        "nodes": len(made.nodes),
        "edges": len(made.edges),
        "nodes_by_kind": dict(sorted(kinds.items())),
        "edges_by_behavior": dict(sorted(behaviors.items())),
        "metres": round(sum(edge.length_m for edge in made.edges), 2),
    }
    if as_json:
        print(json.dumps(document, indent=1))
        return 0
    from rich.console import Console

    console = Console(soft_wrap=True, highlight=False)
    console.print(f"{made.name}: {len(made.nodes)} nodes, {len(made.edges)} edges", markup=False)
    for title, counts in (("nodes", kinds), ("edges", behaviors)):
        console.print(f"  {title}: " + ", ".join(f"{n} {k}" for k, n in sorted(counts.items())))
    console.print(f"wrote {out}", markup=False)
    return 0


def _document(loaded: "TopologicalMap", walk: "Plan") -> dict[str, Any]:
    edges = [loaded.edge(edge) for edge in walk.edges]
    return {
        "nodes": walk.nodes,
        "edges": walk.edges,
        "behaviors": [edge.behavior.value for edge in edges],
        "lengths_m": [round(edge.length_m, 3) for edge in edges],
        "length_m": round(walk.length_m(loaded), 3),
        "difficulty": walk.difficulty.value,
    }


def _print_plan(loaded: "TopologicalMap", walk: "Plan", which: str) -> None:
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    edges = [loaded.edge(edge) for edge in walk.edges]
    table = Table("", "node", "then", "metres", box=None, pad_edge=False)
    for number, (node, edge) in enumerate(zip(walk.nodes, edges, strict=False), start=1):
        table.add_row(str(number), escape(node), edge.behavior.value, f"{edge.length_m:.1f}")
    table.add_row(str(len(walk.nodes)), escape(walk.nodes[-1]), "goal", "")
    console = Console()
    console.print(table)
    console.print(
        f"{which}{len(walk.nodes)} nodes, {walk.length_m(loaded):.1f} m, "
        f"difficulty {walk.difficulty}"
    )


def _draw(
    shown: "TopologicalMap",
    walk: "Plan | None",
    out: Path,
    scene: Path | None,
    source: Path,
    width_in: float,
    title: str | None,
) -> None:
    import matplotlib as mpl

    from toponav.cli._figures import save_figure
    from toponav.maps.figure import map_figure

    figure = map_figure(
        shown,
        walk,
        scene=None if scene is None else load_building(scene),
        floor=floor_of(shown, source) if scene is None else None,
        width_in=width_in,
        title=title,
    )
    # Texts stay texts, so that a figure can be searched and edited.
    with mpl.rc_context({"pdf.fonttype": 42, "svg.fonttype": "none"}):
        save_figure(figure, out, dpi=_DOTS_PER_INCH)
