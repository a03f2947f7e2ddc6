import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from tests.maps.small_maps import office_floor
from toponav.core.episode import Belief
from toponav.core.vocabulary import Behavior
from toponav.maps.draw import BEHAVIOR_COLORS, draw_floor, draw_map
from toponav.maps.plan import shortest_plan
from toponav.maps.spec import MapFrame, TopologicalMap


def _lines(axes) -> dict[tuple[float, ...], list[np.ndarray]]:
    return {
        tuple(collection.get_colors()[0]): collection.get_segments()
        for collection in axes.collections
        if isinstance(collection, LineCollection)
    }


def test_every_behavior_has_its_own_color_and_keeps_to_the_right() -> None:
    from matplotlib.colors import to_rgba

    assert set(BEHAVIOR_COLORS) == set(Behavior)
    assert len(set(BEHAVIOR_COLORS.values())) == len(Behavior)
    axes = Figure().add_subplot()
    draw_map(axes, office_floor())
    lanes = _lines(axes)[to_rgba(BEHAVIOR_COLORS[Behavior.CORRIDOR_FOLLOW])]
    for start, end in lanes:
        if abs(end[0] - start[0]) > 1.5:
            # Going east is drawn south of the nodes, going west north of them.
            assert (end[0] > start[0]) == (start[1] < 0)
    texts = {text.get_text() for text in axes.get_legend().get_texts()}
    assert {"corridor follow", "find door", "room node", "door node"} <= texts


def test_plan_and_belief_are_drawn() -> None:
    floor = office_floor()
    plan = shortest_plan(floor, "office_4", "office_41")
    belief = Belief(
        node="office_4_door",
        edge=plan.edges[1],
        edge_probability={plan.edges[1]: 0.75, plan.edges[2]: 0.25, "unknown": 1.0},
    )
    figure = Figure()
    axes = figure.add_subplot()
    draw_floor(axes, np.zeros((20, 30), dtype=np.bool_), (-3.0, -2.0), 0.5)
    draw_map(axes, floor, plan, belief, labels=False, legend=False)
    segments = [len(lines) for lines in _lines(axes).values()]
    assert len(plan.edges) in segments
    assert 2 in segments
    assert {text.get_text() for text in axes.texts} == {"start", "goal"}
    figure.canvas.draw()


def test_an_empty_map_can_be_drawn() -> None:
    figure = Figure()
    draw_map(figure.add_subplot(), TopologicalMap("empty", MapFrame(), (), ()))
    figure.canvas.draw()
