"""Examples in docstrings run, and give what they say."""

import ast
import doctest
import importlib
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

PACKAGE = Path(__file__).parent.parent / "toponav"


def documented() -> Iterator[tuple[str, str, int, str]]:
    """Module, name, line and docstring of everything with an example, without importing it."""
    for path in sorted(PACKAGE.rglob("*.py")):
        source = path.read_text(encoding="utf-8")
        if ">>>" not in source:
            continue
        module = ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts)
        for element in ast.walk(ast.parse(source)):
            if isinstance(element, ast.ClassDef | ast.FunctionDef):
                text = ast.get_docstring(element) or ""
                if ">>>" in text:
                    yield module, element.name, element.lineno, text


EXAMPLES = list(documented())


@pytest.fixture(scope="module")
def names() -> dict[str, Any]:
    """What examples may take for granted: a building, its map, a plan, and a robot in it."""
    import gymnasium
    import torch
    from matplotlib import pyplot

    from toponav.core.camera import PinholeCamera
    from toponav.core.episode import Velocity
    from toponav.core.geometry import Pose2
    from toponav.data.recording import TrajectoryMetadata
    from toponav.maps.construct import map_from_layout
    from toponav.maps.plan import shortest_plan
    from toponav.maps.spec import load_map
    from toponav.sim.oracle import TruthLocalizer
    from toponav.sim.simulation import Simulation
    from toponav.worlds.generate.office import generate_office

    scene = generate_office(3, size="small")
    topological_map = map_from_layout(scene)
    plan = shortest_plan(topological_map, "office_1", "office_2")
    first = topological_map.node(plan.nodes[0])
    pose = Pose2(first.x_m, first.y_m, topological_map.edge(plan.edges[0]).yaw_rad)
    simulation = Simulation(scene, PinholeCamera())
    simulation.reset(pose)
    return {
        "gymnasium": gymnasium,
        "np": np,
        "plt": pyplot,
        "torch": torch,
        "load_map": load_map,
        "map_from_layout": map_from_layout,
        "shortest_plan": shortest_plan,
        "Path": Path,
        "PinholeCamera": PinholeCamera,
        "Pose2": Pose2,
        "Velocity": Velocity,
        "scene": scene,
        "topological_map": topological_map,
        "plan": plan,
        "pose": pose,
        "velocity": Velocity(0.0, 0.0),
        "command": Velocity(0.3, 0.0),
        "executed": Velocity(0.3, 0.1),
        "depth_m": simulation.observe().depth_m,
        "metadata": TrajectoryMetadata(0, 0, scene.name, scene.content_hash, "", plan),
        "simulation": simulation,
        "localizer": TruthLocalizer(topological_map, scene),
    }


@pytest.fixture
def folder(tmp_path: Path, names: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where examples run: a scene and its map as the commands would have saved them."""
    from toponav.maps.spec import save_map

    monkeypatch.chdir(tmp_path)
    save_map(names["topological_map"], tmp_path / "office.topo.json")
    areas = Path(os.environ.get("TOPONAV_DATA", PACKAGE.parent.parent / "shared" / "data"))
    if (areas / "graphnav_areas").is_dir():
        (tmp_path / "graphnav_areas").symlink_to((areas / "graphnav_areas").resolve())
    return tmp_path


@pytest.mark.parametrize(
    ("module", "name", "line", "text"),
    EXAMPLES,
    ids=[f"{module}.{name}" for module, name, _, text in EXAMPLES],
)
def test_example_gives_what_it_says(module, name, line, text, names, folder):
    if "graphnav_areas/" in text and not (folder / "graphnav_areas").exists():
        pytest.skip("no Stanford areas; set TOPONAV_DATA")
    if "load_agent(None" in text and not any(PACKAGE.glob("weights/compact/*.safetensors")):
        pytest.skip("no weights ship with this version yet")
    namespace = {**vars(importlib.import_module(module)), **names}
    namespace.pop("__name__", None)
    example = doctest.DocTestParser().get_doctest(text, namespace, name, module, line)
    said: list[str] = []
    runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS)
    runner.run(example, out=said.append)
    names["plt"].close("all")
    assert runner.failures == 0, "".join(said)


def test_most_entry_points_have_a_runnable_example():
    runnable = sum("+SKIP" not in text for *_, text in EXAMPLES)
    assert runnable >= 25
    assert runnable > 0.8 * len(EXAMPLES)
