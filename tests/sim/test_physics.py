"""The robot does what it is told, within its limits, and says what it runs into."""

import math

import numpy as np
import pytest

from tests.sim.buildings import CELL_M, furnished_room, room
from toponav.core.camera import PinholeCamera
from toponav.core.episode import Velocity, VelocityLimits
from toponav.core.errors import InputError
from toponav.core.geometry import Pose2, angle_difference
from toponav.sim.physics import build_model
from toponav.sim.robots import TURTLEBOT2, DifferentialRobot
from toponav.sim.simulation import CONTROL_PERIOD_S, PhysicsError, SimState, Simulation
from toponav.worlds.scene import Scene

MIDDLE = Pose2(3.0, 2.0, 0.4)


@pytest.fixture(scope="module")
def hall() -> Simulation:
    """An empty room of 6 m x 4 m."""
    return Simulation(room())


@pytest.fixture(scope="module")
def furnished() -> Scene:
    return furnished_room()


def drive(
    simulation: Simulation, pose: Pose2, linear_m_s: float, angular_rad_s: float, steps: int
) -> list[SimState]:
    states = [simulation.reset(pose)]
    for _ in range(steps):
        states.append(simulation.step(Velocity(linear_m_s, angular_rad_s)))
    return states


def turned_rad(states: list[SimState]) -> float:
    pairs = zip(states[1:], states[:-1], strict=True)
    return sum(angle_difference(b.pose.yaw_rad, a.pose.yaw_rad) for b, a in pairs)


@pytest.mark.parametrize("angular_rad_s", [0.2, -0.7, 1.5])
def test_turn_matches_the_command_within_one_and_a_half_percent(
    hall: Simulation, angular_rad_s: float
) -> None:
    states = drive(hall, MIDDLE, 0.0, angular_rad_s, 25)[5:]
    expected_rad = angular_rad_s * CONTROL_PERIOD_S * (len(states) - 1)
    assert turned_rad(states) == pytest.approx(expected_rad, rel=0.015)
    assert states[-1].pose.distance_to(MIDDLE) < 0.01
    assert states[-1].velocity.angular_rad_s == pytest.approx(angular_rad_s, rel=0.015)


@pytest.mark.parametrize("linear_m_s", [0.1, 0.5, -0.2])
def test_straight_drive_matches_the_command(hall: Simulation, linear_m_s: float) -> None:
    states = drive(hall, MIDDLE, linear_m_s, 0.0, 15)[5:]
    expected_m = abs(linear_m_s) * CONTROL_PERIOD_S * (len(states) - 1)
    assert states[0].pose.distance_to(states[-1].pose) == pytest.approx(expected_m, rel=0.01)
    assert abs(turned_rad(states)) < 0.005
    local = states[-1].pose.relative_to(states[0].pose)
    assert math.copysign(1.0, local.x_m) == math.copysign(1.0, linear_m_s)


def test_arc_has_the_commanded_radius(hall: Simulation) -> None:
    states = drive(hall, MIDDLE, 0.3, 0.6, 25)[10:]
    travelled_m = sum(
        a.pose.distance_to(b.pose) for a, b in zip(states[1:], states[:-1], strict=True)
    )
    assert travelled_m / turned_rad(states) == pytest.approx(0.5, rel=0.02)


def test_speed_rises_no_faster_than_the_limit_and_never_passes_the_cap(hall: Simulation) -> None:
    speeds = [state.velocity.linear_m_s for state in drive(hall, MIDDLE, 9.0, 0.0, 10)]
    assert max(speeds) <= 0.5
    assert speeds[1] == pytest.approx(0.2, abs=0.02)
    assert max(np.diff(speeds)) <= CONTROL_PERIOD_S * VelocityLimits().linear_m_s2 * 1.01


def test_robot_brakes_to_a_stop_and_stays(hall: Simulation) -> None:
    drive(hall, MIDDLE, 0.5, 1.0, 8)
    for _ in range(5):
        state = hall.step(Velocity(0.0, 0.0))
    later = hall.step(Velocity(0.0, 0.0))
    assert abs(later.velocity.linear_m_s) < 1e-3
    assert later.pose.distance_to(state.pose) < 1e-4


def test_standing_robot_stays_where_it_was_put(hall: Simulation) -> None:
    states = drive(hall, MIDDLE, 0.0, 0.0, 10)
    assert states[-1].pose.distance_to(MIDDLE) < 1e-4
    assert [state.time_s for state in states[:4]] == [0.0, 0.2, 0.4, 0.6]


@pytest.mark.parametrize(
    ("start", "contact", "gap_m"),
    [
        # Facing the wall at x = 5.9, the pillar at 3.0, the bench at 4.5 and the step at 4.0.
        (Pose2(5.2, 2.5, 0.0), "wall", 5.9),
        (Pose2(2.3, 2.15, 0.0), "wall", 3.0),
        (Pose2(4.0, 1.2, 0.0), "furniture", 4.5),
        (Pose2(3.5, 3.3, 0.0), "furniture", 4.0),
    ],
)
def test_contact_names_what_was_hit_and_stops_the_robot(
    furnished: Scene, start: Pose2, contact: str, gap_m: float
) -> None:
    states = drive(Simulation(furnished), start, 0.3, 0.0, 15)
    touched = [state.contact for state in states]
    first = next(index for index, name in enumerate(touched) if name)
    assert set(touched[:first]) == {None}
    assert touched[first] == contact
    front_m = max(state.pose.x_m for state in states) + TURTLEBOT2.radius_m
    assert front_m == pytest.approx(gap_m, abs=0.01)


def test_robot_put_into_a_wall_says_so_at_once(furnished: Scene) -> None:
    assert Simulation(furnished).reset(Pose2(0.2, 2.0, 0.0)).contact == "wall"
    assert Simulation(furnished).reset(Pose2(0.4, 2.0, 0.0)).contact is None


def test_grid_edge_holds_the_robot_back() -> None:
    scene = room(opening=(slice(10, 30), slice(59, 60), 0.0))
    states = drive(Simulation(scene), Pose2(5.5, 2.0, 0.0), 0.5, 0.0, 10)
    assert states[-1].contact == "wall"
    assert states[-1].pose.x_m + TURTLEBOT2.radius_m < 6.01


def random_commands(count: int) -> list[Velocity]:
    rng = np.random.default_rng(5)
    return [Velocity(*map(float, rng.uniform((-0.2, -1.5), (0.5, 1.5)))) for _ in range(count)]


def as_bytes(simulation: Simulation, pose: Pose2, commands: list[Velocity]) -> bytes:
    """Everything a roll-out gives: states and images."""
    parts = [repr(simulation.reset(pose)).encode()]
    for command in commands:
        parts.append(repr(simulation.step(command)).encode())
        parts.append(simulation.observe().depth_m.tobytes())
    return b"".join(parts)


def test_reset_simulation_equals_a_fresh_one_to_the_byte(furnished: Scene) -> None:
    camera, commands = PinholeCamera(20, 15), random_commands(20)
    pose = Pose2(4.0, 2.6, 2.0)
    used = Simulation(furnished, camera)
    # Ends in a contact, with wheels turning: nothing of it may remain.
    drive(used, Pose2(5.4, 2.5, 0.0), 0.5, 1.5, 8)
    fresh = Simulation(furnished, camera)
    expected = as_bytes(fresh, pose, commands)
    assert as_bytes(used, pose, commands) == expected
    assert as_bytes(fresh, pose, commands) == expected


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_velocity_that_is_not_finite_never_reaches_the_physics(
    furnished: Scene, bad: float
) -> None:
    simulation = Simulation(furnished)
    before = simulation.reset(Pose2(1.0, 1.0, 0.0))
    for command in (Velocity(bad, 0.0), Velocity(0.0, bad)):
        with pytest.raises(InputError, match="control step 0: a velocity must be finite"):
            simulation.step(command)
    assert simulation.state == before


def test_reset_refuses_places_outside_the_scene(hall: Simulation) -> None:
    for pose in (Pose2(-1.0, 0.0, 0.0), Pose2(1.0, math.nan, 0.0), Pose2(1.0, 1.0, math.inf)):
        with pytest.raises(InputError, match="must start inside the scene"):
            hall.reset(pose)


def test_step_before_reset_and_observe_without_camera_say_what_to_do(furnished: Scene) -> None:
    simulation = Simulation(furnished)
    with pytest.raises(InputError, match=r"call reset\(pose\) first"):
        simulation.step(Velocity(0.0, 0.0))
    simulation.reset(Pose2(1.0, 1.0, 0.0))
    with pytest.raises(InputError, match="pass a PinholeCamera"):
        simulation.observe()


@pytest.mark.parametrize("fault", ["tipped", "lost"])
def test_physics_that_loses_the_robot_says_so(
    fault: str, tmp_path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)  # MuJoCo writes its own log into the working directory
    simulation = Simulation(room())
    simulation.reset(MIDDLE)
    if fault == "tipped":
        simulation._data.qpos[3:7] = (0.7, 0.7, 0.0, 0.0)
    else:
        simulation._data.qvel[0] = math.nan
    with pytest.raises(PhysicsError, match=r"not upright after 0.2 s in scene room.*Remedy"):
        simulation.step(Velocity(0.0, 0.0))
    assert simulation.reset(MIDDLE).pose.distance_to(MIDDLE) < 1e-9


def test_boxes_cover_the_obstacles_and_nothing_else(furnished: Scene) -> None:
    model = build_model(furnished).model
    covered_m2 = 0.0
    heights_m = set()
    for index in range(model.ngeom):
        geom = model.geom(index)
        if geom.name.startswith("box"):
            covered_m2 += 4 * geom.size[0] * geom.size[1]
            heights_m.add(round(2 * float(geom.size[2]), 3))
    assert covered_m2 == pytest.approx(furnished.occupied.sum() * CELL_M**2)
    # Whatever reaches over the robot counts as reaching the ceiling; the rest keeps its height.
    assert heights_m == {2.5, 0.4, 0.15}


def test_robot_weighs_what_it_says(furnished: Scene) -> None:
    model = build_model(furnished).model
    assert float(model.body_mass.sum()) == pytest.approx(TURTLEBOT2.mass_kg)


@pytest.mark.parametrize("field", ["radius_m", "mass_kg", "wheel_separation_m"])
def test_impossible_robots_are_refused(field: str) -> None:
    with pytest.raises(InputError, match=field):
        DifferentialRobot(**{field: -1.0})
    with pytest.raises(InputError, match="under the body"):
        DifferentialRobot(wheel_separation_m=0.5)


def test_real_floor_builds_into_few_boxes(areas_dir) -> None:
    from toponav.worlds.load.stanford import load_area

    model = build_model(load_area(areas_dir / "area_3.yaml")).model
    assert 500 < model.ngeom < 3000
