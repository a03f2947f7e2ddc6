import dataclasses

import numpy as np
import pytest
import torch

from tests.training.synthetic import corridor_map
from toponav.core.camera import PinholeCamera
from toponav.core.episode import Observation, Velocity
from toponav.core.errors import InputError
from toponav.core.vocabulary import Behavior
from toponav.maps.plan import shortest_plan
from toponav.maps.task import NavigationTask
from toponav.models.baselines.behavrnn import BehavRNN
from toponav.models.baselines.phasenet import PhaseNet
from toponav.models.baselines.presets import get_baseline_preset
from toponav.models.checkpoints import save_checkpoint
from toponav.models.graphnav.behavior import BehaviorNetwork
from toponav.models.graphnav.localization import LocalizationNetwork
from toponav.models.graphnav.presets import get_preset
from toponav.navigation.baselines.behavrnn_agent import BehavRNNAgent, load_behavrnn_agent
from toponav.navigation.baselines.driver import driver_for
from toponav.navigation.baselines.phasenet_agent import PhaseNetAgent, load_phasenet_agent

COMPACT, BASELINES = get_preset("compact"), get_baseline_preset("compact")
CAMERA = PinholeCamera()
MAP = corridor_map()
TASK = NavigationTask(MAP, shortest_plan(MAP, "n0", "n4"))
PLANNED = TASK.plan.behaviors(MAP)


@pytest.fixture(scope="module")
def behaviors():
    torch.manual_seed(0)
    return {config.behavior: BehaviorNetwork(config) for config in COMPACT.behaviors}


def frames(count):
    rng = np.random.default_rng(3)
    for step in range(count):
        depth = rng.uniform(0.5, 3.5, (CAMERA.height, CAMERA.width)).astype(np.float32)
        yield Observation(depth, 0.2 * step)


def scripted(network, answers):
    """A network that says what it is told to, and remembers what it was asked."""
    network.asked = []
    answers = list(answers)

    def act(frames, *rest):
        assert frames.shape == (len(network.config.frame_offsets), 32, 96)
        network.asked.append(rest)
        return answers.pop(0), (torch.ones(1),)

    def start(behaviors):
        network.asked.append(tuple(behaviors))
        return (torch.zeros(1),)

    network.act, network.start = act, start
    return network


def drive(agent, count):
    agent.reset(TASK)
    beliefs = []
    for observation in frames(count):
        agent.act(observation)
        beliefs.append(agent.belief())
    return beliefs


def test_phasenet_goes_on_when_a_behavior_is_done_and_stays_at_the_last(behaviors):
    network = scripted(PhaseNet(BASELINES.phasenet), [0.1, 0.95, 0.2, 0.95, 0.95, 0.95, 0.95])
    agent = PhaseNetAgent(network, driver_for(network, behaviors, CAMERA))
    beliefs = drive(agent, 7)
    position = [TASK.plan.nodes.index(belief.node) for belief in beliefs]
    assert position == [0, 1, 1, 2, 3, 3, 3]
    assert [belief.behavior for belief in beliefs] == [PLANNED[place] for place in position]
    assert [belief.edge for belief in beliefs] == [TASK.plan.edges[place] for place in position]
    # The network is asked about what is being executed, afresh after each switch.
    assert [behavior for behavior, _ in network.asked] == [
        PLANNED[place] for place in (0, 0, 1, 1, 2, 3, 3)
    ]
    is_fresh = [state is None for _, state in network.asked]
    assert is_fresh == [True, False, True, False, True, True, False]


def test_behavrnn_executes_what_it_names_and_decides_every_stride(behaviors):
    likeliest = [np.eye(5, dtype=np.float32)[number] for number in (3, 1, 1)]
    network = scripted(BehavRNN(BASELINES.behavrnn), likeliest)
    agent = BehavRNNAgent(network, driver_for(network, behaviors, CAMERA))
    beliefs = drive(agent, 7)
    assert network.asked[0] == PLANNED
    assert len(network.asked) == 1 + 3
    named = [Behavior.TURN_RIGHT] * 3 + [Behavior.FIND_DOOR] * 4
    order = list(Behavior)
    assert [belief.behavior for belief in beliefs] == [order[3]] * 3 + [order[1]] * 4
    assert named == [belief.behavior for belief in beliefs]
    assert all(belief.node is None and belief.edge is None for belief in beliefs)


@pytest.mark.parametrize("name", ["phasenet", "behavrnn"])
def test_untrusted_frames_stop_the_robot_and_reach_no_network(behaviors, name):
    answers = {"phasenet": [0.2, 0.2], "behavrnn": [np.eye(5, dtype=np.float32)[0]]}[name]
    real = PhaseNet(BASELINES.phasenet) if name == "phasenet" else BehavRNN(BASELINES.behavrnn)
    network = scripted(real, answers)
    agent_type = PhaseNetAgent if name == "phasenet" else BehavRNNAgent
    agent = agent_type(network, driver_for(network, behaviors, CAMERA))
    agent.reset(TASK)
    good, bad = frames(2)
    assert agent.act(good) != Velocity(0.0, 0.0)
    asked = len(network.asked)
    bad.depth_m[0, 0] = np.nan
    assert agent.act(bad) == Velocity(0.0, 0.0)
    assert "NaN" in agent.belief().stopped_because
    assert len(network.asked) == asked


@pytest.mark.parametrize("name", ["phasenet", "behavrnn"])
def test_answers_that_are_not_finite_stop_the_robot(behaviors, name):
    if name == "phasenet":
        network = scripted(PhaseNet(BASELINES.phasenet), [float("nan")])
        agent = PhaseNetAgent(network, driver_for(network, behaviors, CAMERA))
    else:
        network = scripted(BehavRNN(BASELINES.behavrnn), [np.full(5, np.nan, np.float32)])
        agent = BehavRNNAgent(network, driver_for(network, behaviors, CAMERA))
    agent.reset(TASK)
    assert agent.act(next(frames(1))) == Velocity(0.0, 0.0)
    assert "not finite" in agent.belief().stopped_because


def test_agents_of_a_folder_repeat_themselves_exactly(behaviors, tmp_path):
    for behavior, network in behaviors.items():
        save_checkpoint(network, tmp_path / f"behavior_{behavior}")
    save_checkpoint(LocalizationNetwork(COMPACT.localization), tmp_path / "localization")
    with pytest.raises(InputError, match="no behavrnn"):
        load_behavrnn_agent(str(tmp_path), camera=CAMERA)
    save_checkpoint(PhaseNet(BASELINES.phasenet), tmp_path / "phasenet")
    save_checkpoint(BehavRNN(BASELINES.behavrnn), tmp_path / "behavrnn")
    for load in (load_phasenet_agent, load_behavrnn_agent):
        agent = load(str(tmp_path), camera=CAMERA)
        runs = []
        for _ in range(2):
            agent.reset(TASK)
            runs.append([agent.act(observation) for observation in frames(4)])
        assert runs[0] == runs[1]


def test_networks_that_see_different_images_are_refused(behaviors):
    image = dataclasses.replace(COMPACT.image, max_depth_m=3.0)
    other = PhaseNet(dataclasses.replace(BASELINES.phasenet, image=image))
    with pytest.raises(InputError, match="phasenet sees another image"):
        driver_for(other, behaviors, CAMERA)
