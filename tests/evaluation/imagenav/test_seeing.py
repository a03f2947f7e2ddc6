"""The film and the page of a search, and a building that is mapped."""

from pathlib import Path

import numpy as np
import pytest

from tests.evaluation.imagenav.searches import START, building, episode, network
from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.core.imagenav import ImageNavBelief
from toponav.evaluation.imagenav import worker as workers
from toponav.evaluation.imagenav.agents import ImageNavChoice
from toponav.evaluation.imagenav.explore import ExploreConfig, explore_building, map_of_graph
from toponav.evaluation.imagenav.film import FILM_SIZE, PlanPanel
from toponav.evaluation.imagenav.page import film_episode, search_section
from toponav.evaluation.imagenav.worker import ImageNavSettings, ImageNavWorker
from toponav.maps.image_graph import ImageGraph
from toponav.models.checkpoints import save_checkpoint


def test_a_search_becomes_a_page_and_a_film(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(workers, "_scene", lambda generator, seed: building())
    save_checkpoint(network(), tmp_path / "weights" / "nts_rgbd.safetensors")
    settings = ImageNavSettings(max_steps=4, weights=str(tmp_path / "weights"))
    worker = ImageNavWorker(settings, [ImageNavChoice.parse("nts_rgbd")])
    made = film_episode(worker, "nts_rgbd", episode(), tmp_path / "page")
    page = made.page.read_text()
    assert made.film.stat().st_size > 5_000
    assert made.film.read_bytes()[4:8] == b"ftyp"
    assert "Neural Topological SLAM looks for a place" in page
    assert "ran out of steps" in page
    assert page.count("data:image/jpeg;base64,") >= 2
    assert "http" not in page.replace("http-equiv", "")
    section = search_section(made)
    assert "It ran out of steps." in section
    assert 'href="image-goal/index.html"' in section
    assert "data:video/mp4;base64," in section


def test_the_plan_shows_a_point_where_it_lies() -> None:
    panel = PlanPanel(building(), (500, 300))
    assert FILM_SIZE[0] % 16 == FILM_SIZE[1] % 16 == 0
    # The building is 10 x 6 m and fills the panel; y grows upwards.
    assert panel.at(0.0, 0.0) == pytest.approx((0.0, 300.0), abs=1.0)
    assert panel.at(10.0, 6.0) == pytest.approx((500.0, 0.0), abs=1.0)
    drawn = panel.draw(episode(), ImageNavBelief(), [START], Pose2(8.0, 3.0, 0.0))
    gold = np.asarray(drawn)[round(panel.at(8.0, 3.0)[1]), round(panel.at(8.0, 3.0)[0])]
    assert gold[0] > 200
    assert gold[2] < 100


def test_exploring_gives_a_graph_and_a_map_at_the_true_place() -> None:
    told = []
    found = explore_building(
        building(), network(), ExploreConfig(steps=25, start=START), lambda *n: told.append(n)
    )
    assert found.steps <= 25
    assert told[-1] == (found.steps, 25)
    assert found.graph.nodes
    assert found.map.nodes
    assert found.off_m < 0.5
    assert 0.3 < found.covered <= 1.0
    # The floor that was seen lies where the building is.
    row, col = found.floor.grid.cell_of(START.x_m, START.y_m)
    assert not found.floor.occupied[row, col]
    if found.why_no_rooms:
        first = found.map.node("place_0")
        assert (first.x_m, first.y_m) == pytest.approx((START.x_m, START.y_m), abs=0.3)


def test_an_image_graph_becomes_a_map_with_ways_both_ways() -> None:
    graph = ImageGraph()
    for x_m in (0.0, 3.0, 6.0):
        graph.add_node(Pose2(x_m, 0.0, 0.0), 0)
    graph.add_edge(0, 1)
    graph.add_edge(1, 2)
    made = map_of_graph(graph, Pose2(1.0, 2.0, np.pi / 2), "home")
    assert {edge.id for edge in made.edges} == {
        "place_0->place_1",
        "place_1->place_0",
        "place_1->place_2",
        "place_2->place_1",
    }
    last = made.node("place_2")
    assert (last.x_m, last.y_m) == pytest.approx((1.0, 8.0))


def test_exploring_without_steps_is_refused() -> None:
    with pytest.raises(InputError, match="steps must be"):
        ExploreConfig(steps=0)
