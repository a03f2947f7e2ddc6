"""Image-goal navigation in a building: motion, contact, goals, repetition."""

import math

import numpy as np
import pytest

from tests.sim.two_rooms import CELL_M, two_rooms
from toponav.core.camera import PanoramaCamera
from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.core.imagenav import FORWARD_M, TURN_RAD, Action
from toponav.sim.disc_kernels import clearance_of_point
from toponav.sim.imagenav import ImageNavSimulation

CAMERA = PanoramaCamera(16, 64)
START, GOAL = Pose2(2.0, 3.0, 0.0), Pose2(8.0, 3.0, 1.0)


def simulation(**options) -> ImageNavSimulation:  # type: ignore[no-untyped-def]
    return ImageNavSimulation(two_rooms(), CAMERA, **options)


def slow_clearance_m(simulated: ImageNavSimulation, pose: Pose2) -> float:
    """Distance to the nearest solid square, over all squares of the grid."""
    rows, cols = np.nonzero(simulated.scene.occupied)
    dx = np.maximum(np.maximum(cols * CELL_M - pose.x_m, pose.x_m - (cols + 1) * CELL_M), 0)
    dy = np.maximum(np.maximum(rows * CELL_M - pose.y_m, pose.y_m - (rows + 1) * CELL_M), 0)
    return float(np.hypot(dx, dy).min())


def test_without_noise_actions_do_what_they_mean() -> None:
    simulated = simulation(noise=None)
    simulated.reset(START, GOAL)
    assert simulated.step(Action.FORWARD).pose == pytest.approx((2.0 + FORWARD_M, 3.0, 0.0))
    assert simulated.step(Action.LEFT).pose.yaw_rad == pytest.approx(TURN_RAD)
    simulated.step(Action.RIGHT)
    assert simulated.step(Action.RIGHT).pose.yaw_rad == pytest.approx(-TURN_RAD)
    truth = simulated.state.pose.relative_to(START)
    assert simulated.observe().odometry == pytest.approx(truth)


@pytest.mark.parametrize("sliding", [False, True])
def test_the_robot_never_enters_anything(sliding: bool) -> None:
    simulated = simulation(sliding=sliding)
    simulated.reset(START, GOAL, seed=1)
    rng = np.random.default_rng(5)
    for _ in range(450):
        state = simulated.step(Action(int(rng.choice([1, 1, 1, 1, 2]))))
        assert slow_clearance_m(simulated, state.pose) > simulated.radius_m - 0.003
    assert state.collisions > 20


def test_the_fast_clearance_is_the_slow_one() -> None:
    simulated = simulation()
    solid, rng = simulated.scene.occupied, np.random.default_rng(0)
    for _ in range(200):
        pose = Pose2(float(rng.uniform(0.3, 9.7)), float(rng.uniform(0.3, 5.7)), 0.0)
        found, _, _ = clearance_of_point(solid, pose.y_m / CELL_M, pose.x_m / CELL_M, 5.0)
        assert found * CELL_M == pytest.approx(min(slow_clearance_m(simulated, pose), 0.5))


def test_a_wall_stops_the_robot_where_it_touches() -> None:
    simulated = simulation(noise=None)
    simulated.reset(Pose2(4.5, 1.0, 0.5), GOAL)
    state = simulated.step(Action.FORWARD)
    assert not state.collided
    state = simulated.step(Action.FORWARD)
    assert state.collided
    assert state.pose.x_m == pytest.approx(4.9 - 0.18, abs=1e-3)
    again = simulated.step(Action.FORWARD)
    assert again.pose.distance_to(state.pose) < 1e-3
    assert again.collisions == 2
    odometry = simulated.observe().odometry
    assert odometry == pytest.approx(again.pose.relative_to(Pose2(4.5, 1.0, 0.5)))


def test_sliding_goes_on_along_the_wall() -> None:
    simulated = simulation(noise=None, sliding=True)
    simulated.reset(Pose2(4.7, 1.0, math.radians(60)), GOAL)
    state = simulated.step(Action.FORWARD)
    assert state.collided
    assert state.pose.x_m == pytest.approx(4.9 - 0.18, abs=2e-3)
    assert state.pose.y_m == pytest.approx(1.0 + FORWARD_M * math.sin(math.radians(60)), abs=0.01)


def test_stopping_at_the_goal_succeeds_and_elsewhere_fails() -> None:
    simulated = simulation(noise=None)
    simulated.reset(Pose2(7.1, 3.0, 0.0), GOAL)
    assert simulated.step(Action.STOP).success
    simulated.reset(Pose2(6.9, 3.0, 0.0), GOAL)
    state = simulated.step(Action.STOP)
    assert state.done
    assert not state.success
    with pytest.raises(InputError, match="over"):
        simulated.step(Action.FORWARD)


def test_the_other_side_of_a_wall_is_not_the_goal() -> None:
    simulated = simulation(noise=None)
    simulated.reset(Pose2(4.65, 1.0, 0.0), Pose2(5.35, 1.0, 0.0))
    assert simulated.distance_to_goal_m() > 3.0
    assert not simulated.step(Action.STOP).success


def test_without_stop_the_episode_ends_at_the_goal() -> None:
    simulated = simulation(noise=None, stop=False)
    simulated.reset(Pose2(6.5, 3.0, 0.0), GOAL)
    assert not simulated.step(Action.STOP).done
    assert not simulated.step(Action.FORWARD).done
    state = simulated.step(Action.FORWARD)
    assert state.done
    assert state.success
    assert state.path_m == pytest.approx(0.5)


def test_an_episode_ends_after_its_last_step() -> None:
    simulated = simulation(max_steps=2)
    simulated.reset(START, GOAL)
    assert not simulated.step(Action.LEFT).done
    state = simulated.step(Action.LEFT)
    assert state.done
    assert not state.success


def test_the_same_seed_gives_the_same_bytes_and_another_does_not() -> None:
    def run(seed: int) -> bytes:
        simulated.reset(START, GOAL, seed)
        found = []
        for action in (1, 2, 1, 3, 1, 1):
            state = simulated.step(Action(action))
            seen = simulated.observe()
            assert seen.depth_m is not None
            found += [repr(state), repr(seen.odometry), seen.rgb.tobytes(), seen.depth_m.tobytes()]
        return repr(found).encode()

    simulated = simulation()
    first = run(3)
    assert run(3) == first
    simulated = simulation()
    assert run(3) == first
    assert run(4) != first


def test_the_noise_of_a_step_does_not_depend_on_the_steps_before() -> None:
    ends = []
    for first in (Action.LEFT, Action.FORWARD):
        simulated = simulation()
        simulated.reset(START, GOAL, seed=9)
        before = simulated.step(first).pose
        ends.append(simulated.step(Action.FORWARD).pose.relative_to(before))
    assert ends[0] == pytest.approx(ends[1])


def test_odometry_drifts_from_the_truth_with_noise() -> None:
    simulated = simulation()
    simulated.reset(START, GOAL, seed=2)
    for _ in range(36):
        simulated.step(Action.LEFT)
    truth = simulated.state.pose.relative_to(START)
    reading = simulated.observe().odometry
    assert 0.01 < math.hypot(truth.x_m - reading.x_m, truth.y_m - reading.y_m) < 1.0


def test_the_goal_s_picture_is_what_the_robot_sees_there() -> None:
    simulated = simulation(noise=None)
    goal = simulated.reset(GOAL, GOAL)
    seen = simulated.observe()
    assert goal.depth_m is not None
    assert seen.depth_m is not None
    assert (goal.rgb == seen.rgb).all()
    assert (goal.depth_m == seen.depth_m).all()


def test_a_robot_without_depth_has_none() -> None:
    simulated = simulation(depth=False)
    assert simulated.reset(START, GOAL).depth_m is None
    assert simulated.observe().depth_m is None


def test_the_next_goal_starts_where_the_robot_is() -> None:
    simulated = simulation()
    simulated.reset(START, GOAL, seed=1)
    simulated.step(Action.FORWARD)
    pose, odometry = simulated.state.pose, simulated.observe().odometry
    simulated.step(Action.STOP)
    simulated.next_goal(START)
    assert simulated.state.pose == pose
    assert simulated.state.step == 0
    assert not simulated.state.done
    assert simulated.observe().odometry == odometry
    assert simulated.step(Action.STOP).success


@pytest.mark.parametrize(
    "pose", [Pose2(0.05, 3.0, 0.0), Pose2(4.85, 1.0, 0.0), Pose2(50.0, 3.0, 0.0)]
)
def test_a_robot_cannot_start_in_a_wall(pose: Pose2) -> None:
    with pytest.raises(InputError, match="start"):
        simulation().reset(pose, GOAL)
    with pytest.raises(InputError, match="goal"):
        simulation().reset(START, pose)


def test_wrong_settings_are_refused() -> None:
    with pytest.raises(InputError, match="noise"):
        simulation(noise="kobuki")
    with pytest.raises(InputError, match="max_steps"):
        simulation(max_steps=0)
    with pytest.raises(InputError, match="reset"):
        simulation().step(Action.FORWARD)
    simulated = simulation()
    with pytest.raises(InputError, match="seed"):
        simulated.reset(START, GOAL, seed=-1)
