import math
import time
from pathlib import Path

import numpy as np
import pytest

from tests.data.expert_world import small_office
from toponav.core.episode import Velocity, VelocityLimits
from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.data.expert import Expert
from toponav.maps.formats.canvas import load_area_map
from toponav.maps.plan import Plan, shortest_plan
from toponav.sim.oracle import TruthLocalizer
from toponav.sim.simulation import Simulation
from toponav.worlds.load.stanford import load_area, load_pairs

STILL = Velocity(0.0, 0.0)
START = Pose2(2.0, 8.5, -1.2)


@pytest.fixture(scope="module")
def world():
    scene, topological_map = small_office()
    return (
        Expert(scene, topological_map),
        Simulation(scene),
        TruthLocalizer(topological_map, scene),
    )


@pytest.fixture(scope="module")
def plan() -> Plan:
    return shortest_plan(small_office()[1], "office_1", "office_2")


def drive(world, plan: Plan, start: Pose2, steps: int = 300, push=None):
    """Poses, commands and true nodes until the goal; fails on any contact."""
    expert, simulation, truth = world
    expert.reset(plan, start)
    state = simulation.reset(start)
    poses, commands, nodes = [], [], []
    for step in range(steps):
        command = expert.act(state.pose, state.velocity)
        executed = command if push is None else push(step, command)
        state = simulation.step(executed)
        assert state.contact is None, f"touched {state.contact} at {state.pose}"
        poses.append(state.pose)
        commands.append(command)
        nodes.append(truth.node_at(state.pose))
        if nodes[-1] == plan.nodes[-1]:
            break
    return poses, commands, nodes


def test_expert_reaches_the_goal_without_leaving_the_plan(world, plan):
    _, _, nodes = drive(world, plan, START)
    assert nodes[-1] == "office_2"
    assert {node for node in nodes if node is not None} <= set(plan.nodes)


def test_expert_passes_the_plans_nodes_in_their_order(world, plan):
    _, _, nodes = drive(world, plan, START)
    positions = [plan.position(node) for node in nodes if node is not None]
    assert positions == sorted(positions)


def test_way_back_works_too(world):
    back = shortest_plan(small_office()[1], "office_2", "office_1")
    _, _, nodes = drive(world, back, Pose2(11.5, 2.0, 2.2))
    assert nodes[-1] == "office_1"


def test_commands_are_smooth_and_within_limits(world, plan):
    _, commands, _ = drive(world, plan, START)
    linear = np.array([command.linear_m_s for command in commands])
    angular = np.array([command.angular_rad_s for command in commands])
    limits = VelocityLimits()
    assert linear.max() <= limits.linear_m_s
    assert np.abs(angular).max() <= limits.angular_rad_s
    assert linear.mean() > 0.4
    assert np.abs(np.diff(angular)).mean() < 0.06


def test_corridor_is_driven_near_its_middle(world, plan):
    poses, _, _ = drive(world, plan, START)
    inside = [pose.y_m for pose in poses if 5.0 < pose.x_m < 8.0]
    assert len(inside) > 10
    assert np.ptp(inside) < 0.15
    assert abs(np.mean(inside) - 6.0) < 0.25


def test_same_calls_give_same_commands(world, plan):
    first = drive(world, plan, START)
    drive(world, shortest_plan(small_office()[1], "office_2", "office_1"), Pose2(11.5, 2.0, 2.2))
    assert drive(world, plan, START) == first


@pytest.mark.parametrize("side_m", [-0.5, 0.5])
@pytest.mark.parametrize("turn_rad", [-0.7, 0.7])
def test_expert_returns_from_half_a_metre_and_forty_degrees_off(world, plan, side_m, turn_rad):
    expert, simulation, truth = world
    expert.reset(plan, START)
    state = simulation.reset(Pose2(6.0, 5.9 + side_m, turn_rad))
    for _ in range(200):
        state = simulation.step(expert.act(state.pose, state.velocity))
        assert state.contact is None
        if truth.node_at(state.pose) == "office_2":
            return
    pytest.fail(f"did not arrive, ended at {state.pose}")


def test_noise_of_the_paper_causes_no_contact(world, plan):
    random = np.random.default_rng(3)
    noise = np.zeros(2)

    def push(step: int, command: Velocity) -> Velocity:
        noise[:] = 0.95 * noise + 0.05 * random.normal(0.0, [0.2, 1.0])
        return Velocity(command.linear_m_s + noise[0], command.angular_rad_s + noise[1])

    assert drive(world, plan, START, push=push)[2][-1] == "office_2"


def test_states_far_off_the_path_are_labelled_with_the_way_back(world, plan):
    expert, _, _ = world
    expert.reset(plan, START)
    west = expert.act(Pose2(1.0, 6.0, math.pi), STILL)
    assert west.linear_m_s < 0.1
    assert abs(west.angular_rad_s) > 0.5
    expert.reset(plan, START)
    assert expert.act(Pose2(1.5, 6.0, 0.0), STILL).linear_m_s > 0.2


def test_pose_without_a_way_on_gets_a_command_all_the_same(world, plan):
    expert, _, _ = world
    expert.reset(plan, START)
    command = expert.act(Pose2(6.0, 3.0, 0.0), STILL)
    assert VelocityLimits().clip(command) == command


def test_what_lies_behind_is_turned_to_by_the_left(world, plan):
    expert, _, _ = world
    expert.reset(plan, START)
    for yaw_rad in (2.0, 2.8, 3.5):
        assert expert.act(Pose2(2.1, 8.3, yaw_rad), STILL).angular_rad_s > 0.5


def test_expert_starts_from_behind_furniture_facing_away(world, plan):
    _, _, nodes = drive(world, plan, Pose2(3.5, 10.7, 1.5))
    assert nodes[-1] == "office_2"


def test_start_without_a_way_is_refused_with_the_place(world, plan):
    with pytest.raises(InputError, match=r"office_1 -> office_2.*no way.*\(6\.00, 3\.00\)"):
        world[0].reset(plan, Pose2(6.0, 3.0, 0.0))


def test_act_is_fast_enough_to_collect_and_relabel(world, plan):
    expert, _, _ = world
    expert.reset(plan, START)
    expert.act(START, STILL)
    fastest = math.inf
    for _ in range(5):
        began = time.perf_counter()
        for _ in range(50):
            expert.act(START, STILL)
        fastest = min(fastest, (time.perf_counter() - began) / 50)
    assert fastest < 1 / 1500


def test_expert_drives_published_pairs_of_an_area(areas_dir: Path):
    scene, topological_map = load_area(areas_dir / "area_3.yaml"), None
    topological_map = load_area_map(areas_dir / "area_3.yaml")
    world = (
        Expert(scene, topological_map),
        Simulation(scene),
        TruthLocalizer(topological_map, scene),
    )
    for pair in load_pairs(areas_dir / "area_3_plans.json")[:4]:
        plan = shortest_plan(topological_map, pair.start_room, pair.end_room)
        assert drive(world, plan, pair.start_pose, 600)[2][-1] == pair.end_room
