from pathlib import Path

import numpy as np
import pytest

import toponav
from tests.evaluation.stand_ins import Spinner
from tests.evaluation.tiny_building import tiny_map, tiny_scene
from toponav.core.episode import Observation, Velocity
from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.evaluation import agents
from toponav.evaluation.agents import (
    AGENTS,
    AgentChoice,
    AgentContext,
    ExpertAgent,
    check_agent_name,
    check_weights,
    make_agent,
    title_of,
)
from toponav.evaluation.protocol import Truth
from toponav.maps.plan import Plan, shortest_plan
from toponav.maps.task import NavigationTask

MAP = tiny_map()


def test_the_registry_has_the_design_pages_names() -> None:
    drivers = {name for name, spec in AGENTS.items() if not spec.is_probe}
    assert drivers >= {"phasenet", "behavrnn", "graphnav", "graphnav_pf", "gtl", "expert"}
    privileged = [name for name in drivers if AGENTS[name].is_privileged]
    assert sorted(privileged) == ["expert", "gtl"]


def test_an_unknown_agent_is_refused_with_the_nearest_name() -> None:
    with pytest.raises(InputError, match="did you mean 'graphnav_pf'"):
        check_agent_name("graphnav_fp")


@pytest.mark.parametrize(
    "name", ["no_such_module:make", "tests.evaluation.stand_ins:nothing", "math:pi", ":"]
)
def test_an_agent_that_cannot_be_imported_is_refused(name: str) -> None:
    with pytest.raises(InputError, match="--agent"):
        check_agent_name(name)


def test_ones_own_agent_is_made_by_its_factory() -> None:
    context = AgentContext(tiny_scene(), MAP)
    assert isinstance(make_agent("tests.evaluation.stand_ins:spinner", context), Spinner)


@pytest.mark.parametrize("name", ["phasenet", "behavrnn"])
def test_shipped_baselines_are_whole_and_small(name: str) -> None:
    check_weights(None, [name])
    weights = Path(toponav.__file__).parent / "weights" / "compact" / f"{name}.safetensors"
    assert weights.stat().st_size < 2_000_000
    context = AgentContext(tiny_scene(), MAP)
    agent = make_agent(name, context)
    agent.reset(NavigationTask(MAP, shortest_plan(MAP, "office_1", "office_2")))
    depth = np.random.default_rng(0).uniform(0.5, 3.0, (240, 320)).astype(np.float32)
    assert agent.act(Observation(depth, 0.0)) != Velocity(0.0, 0.0)
    assert agent.belief().behavior is not None


@pytest.mark.parametrize("name", ["phasenet", "behavrnn"])
def test_weights_without_the_baseline_are_refused_before_anything_runs(
    name: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=f"no {name}"):
        check_weights(str(tmp_path), [name])


class NoWay:
    """A planner that finds none."""

    def reset(self, plan: Plan, pose: Pose2) -> None:
        raise InputError("no way to the goal", where="plan", remedy="start elsewhere")

    def act(self, pose: Pose2, velocity: Velocity) -> Velocity:
        raise AssertionError("never asked")


def test_an_expert_without_a_way_stops_and_says_why() -> None:
    agent = ExpertAgent(NoWay())
    agent.reset(NavigationTask(MAP, shortest_plan(MAP, "office_1", "office_2")))
    still = Velocity(0.0, 0.0)
    agent.observe_truth(Truth(Pose2(1.0, 1.0, 0.0), still, "office_1", 0, None, None))
    image = Observation(np.ones((2, 2), np.float32), 0.0)
    assert agent.act(image) == still
    assert agent.belief().stopped_because == "no way to the goal"


def test_a_choice_names_weights_and_settings() -> None:
    own = "tests.evaluation.stand_ins:spinner"
    choice = AgentChoice.parse(f"{own}=runs/a,speed=2,label=slow one")
    assert (choice.agent, choice.weights, choice.label) == (own, "runs/a", "slow one")
    assert choice.options == (("speed", "2"),)
    assert AgentChoice.parse("gtl").label == "gtl"
    assert AgentChoice.parse("gtl,weights=runs/a").weights == "runs/a"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("gtl,particles=3", "gtl has no setting 'particles'"),
        ("gtl,particles", "'particles' is no setting"),
        ("gtl=a,weights=b", "'weights=b' is no setting"),
        ("glt=a", "did you mean 'gtl'"),
        ("gtl,label=a\nb", "printable"),
    ],
)
def test_a_senseless_choice_is_refused(text: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        AgentChoice.parse(text)


def test_titles_tell_two_weights_of_one_agent_apart() -> None:
    assert title_of("graphnav_pf") == "GraphNavPF"
    assert title_of("graphnav_pf=runs/a") == "GraphNavPF (runs/a)"
    assert title_of("mine", "graphnav_pf") == "GraphNavPF (mine)"
    assert title_of("package:factory") == "package:factory"


def test_another_kind_of_weights_can_build_the_same_names(monkeypatch: pytest.MonkeyPatch) -> None:
    made = Spinner()
    family = agents.WeightsFamily("other", lambda weights: weights == "x", {"gtl": lambda _: made})
    monkeypatch.setattr(agents, "FAMILIES", (family, *agents.FAMILIES))
    context = AgentContext(tiny_scene(), MAP, weights="x")
    assert make_agent("gtl", context) is made
    with pytest.raises(InputError, match="no graphnav for weights of the kind 'other'"):
        make_agent("graphnav", context)
