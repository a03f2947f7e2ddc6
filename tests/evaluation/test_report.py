import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from tests.evaluation.records import MAP, PLAN, STEP, record, verdict
from tests.evaluation.tiny_building import tiny_scene
from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.core.vocabulary import Behavior, Outcome
from toponav.evaluation.demo import DemoConfig
from toponav.evaluation.figures import belief_over_time, draw_belief, episode_figure
from toponav.evaluation.report.film import FilmStep, film_frames, write_film
from toponav.evaluation.report.images import belief_image, colorize_depth, depth_bytes
from toponav.evaluation.report.page import DemoReport, DepthView, render_page
from toponav.evaluation.report.strip import belief_strip
from toponav.evaluation.report.svg import Canvas, floor_defs, map_layer
from toponav.evaluation.suite import EpisodeTask, Suite

SCENE = tiny_scene()
DEPTH = np.tile(np.linspace(0, 255, 32, dtype=np.uint8), (24, 1))


def film_step(number: int) -> FilmStep:
    edge = PLAN.edges[number % len(PLAN.edges)]
    pose = Pose2(1.0 + 0.1 * number, 2.0, 0.2 * number)
    return FilmStep(0.2 * number, DEPTH, pose, Behavior.STRAIGHT, {edge: 0.9}, "here", "there")


def report(**changes: object) -> DemoReport:
    task = EpisodeTask(0, PLAN, Pose2(2.0, 1.8, 1.5))
    lost = record("gtl", strict=verdict(Outcome.COLLIDED, 2))
    made = DemoReport(
        suite=Suite("tiny", SCENE, MAP, (task,)),
        agents=("graphnav_pf", "gtl"),
        records={("graphnav_pf", 0): record("graphnav_pf"), ("gtl", 0): lost},
        hero=record("graphnav_pf"),
        beliefs=[{PLAN.edges[0]: 0.9, PLAN.edges[1]: 0.1}] * 2,
        views=[DepthView(DEPTH, "at <the> door")],
        film=b"film",
        fps=15.0,
        area_m2=40.0,
        real_time_factor=30.0,
        facts=["seed 0"],
    )
    return replace(made, **changes)


def test_depth_images_are_light_near_and_dark_far() -> None:
    depth = depth_bytes(np.array([[0.0, 1.0, 3.5, 9.0]], np.float32), 3.5)
    lightness = colorize_depth(depth).astype(int).sum(axis=2)[0]
    assert lightness[0] > lightness[1] > lightness[2] == lightness[3]


def test_the_belief_image_is_as_opaque_as_the_belief_is_strong() -> None:
    alpha = belief_image(np.array([[0.0, 0.25, 1.0]]))[0, :, 3]
    assert alpha.tolist() == [0, 128, 255]


def test_belief_over_time_has_a_row_per_plan_edge_and_one_for_the_rest() -> None:
    astray = replace(STEP, elsewhere_probability=0.5)
    matrix = belief_over_time(record(steps=(STEP, astray)))
    assert matrix.shape == (len(PLAN.edges) + 1, 2)
    assert matrix[0].tolist() == [0.75, 0.75]
    assert matrix[-1].tolist() == [0.0, 0.5]


def test_walls_are_drawn_with_exactly_their_area() -> None:
    canvas = Canvas.around(SCENE)
    walls = re.search(r'class="wall" d="([^"]*)"', floor_defs(canvas, SCENE))
    assert walls is not None
    sizes = re.findall(r"h([\d.]+)v([\d.]+)", walls[1])
    area_px = sum(float(width) * float(height) for width, height in sizes)
    origin, corner = canvas.at(0.0, 0.0), canvas.at(1.0, 1.0)
    px2_per_m2 = (corner[0] - origin[0]) * (origin[1] - corner[1])
    assert area_px / px2_per_m2 == pytest.approx(SCENE.occupied.sum() * 0.01, rel=1e-3)


def test_every_edge_of_the_map_can_be_lit_up() -> None:
    drawn = map_layer(Canvas.around(SCENE), MAP, PLAN)
    assert drawn.count("data-edge=") == len(MAP.edges)
    assert drawn.count("<title>") == len(MAP.nodes)


def test_the_truth_line_leaves_a_gap_where_no_node_fits() -> None:
    lost = replace(STEP, true_node=None)
    whole = belief_strip(record(steps=(STEP,) * 4))
    broken = belief_strip(record(steps=(STEP, lost, STEP, STEP)))
    truth = r'class="truth" d="([^"]*)"'
    assert re.findall(truth, whole)[0].count("M") == 1
    assert re.findall(truth, broken)[0].count("M") == 2


def test_the_page_needs_no_other_file() -> None:
    page = render_page(report())
    links = re.findall(r'(?:src|href)="([^"]*)"', page)
    assert links
    assert all(link.startswith(("data:", "#")) for link in links)
    assert "http://" not in page
    assert "https://" not in page
    assert "$" not in re.sub(r"\$\{[^}]*\}", "", page)


def test_the_page_escapes_what_it_quotes() -> None:
    page = render_page(report())
    assert "at &lt;the&gt; door" in page
    assert "<the>" not in page


def test_the_page_says_honestly_when_no_plan_was_completed() -> None:
    lost = record("graphnav_pf", strict=verdict(Outcome.STUCK, 3))
    records = {("graphnav_pf", 0): lost, ("gtl", 0): record("gtl")}
    page = render_page(report(hero=lost, records=records))
    assert "GraphNavPF completed no plan this time" in page
    assert "got stuck" in page


def test_a_momentary_deviation_is_told_apart_from_success() -> None:
    brief = record(
        "gtl", strict=verdict(Outcome.DEVIATED, 3), tolerant=verdict(Outcome.SUCCESS, 5)
    )
    records = {("graphnav_pf", 0): record("graphnav_pf"), ("gtl", 0): brief}
    assert "off the plan for a moment near office 1" in render_page(report(records=records))


def test_a_film_has_a_frame_per_step(tmp_path: Path) -> None:
    steps = [film_step(number) for number in range(4)]
    frames = list(film_frames(SCENE, MAP, PLAN, steps, title="GTL", max_depth_m=3.5))
    assert len(frames) == 4
    assert all(frame.shape == frames[0].shape for frame in frames)
    assert not np.array_equal(frames[0], frames[1])
    write_film(tmp_path / "film.mp4", iter(frames), 15.0)
    content = (tmp_path / "film.mp4").read_bytes()
    assert content[4:8] == b"ftyp"


def test_an_episode_has_a_figure_for_papers(tmp_path: Path) -> None:
    lost = replace(STEP, true_node=None, true_edge=None, behavior=None, x_m=1.5)
    made = record(strict=verdict(Outcome.DEVIATED, 3), steps=(STEP, lost, STEP))
    episode_figure(SCENE, MAP, made).savefig(tmp_path / "episode.png")
    assert (tmp_path / "episode.png").stat().st_size > 10_000
    axes = Figure().subplots()
    draw_belief(axes, made)
    assert [label.get_text() for label in axes.get_yticklabels()][-1] == "off the plan"


@pytest.mark.parametrize("change", [{"building": 50}, {"plans": 0}, {"agents": ("graphnva",)}])
def test_a_senseless_demo_is_refused(change: dict[str, object]) -> None:
    with pytest.raises(InputError):
        DemoConfig(**change)
