"""`toponav/ImageNav-v0` keeps Gymnasium's rules."""

import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from tests.sim.two_rooms import two_rooms
from toponav.core.camera import PanoramaCamera
from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.core.imagenav import Action, ImageNavEpisode
from toponav.sim.imagenav_env import ImageNavEnv

CAMERA = PanoramaCamera(16, 64)


def made(**options) -> ImageNavEnv:  # type: ignore[no-untyped-def]
    return ImageNavEnv(two_rooms(), CAMERA, **options)


@pytest.mark.parametrize("depth", [True, False])
def test_gymnasium_s_checker_passes(depth: bool) -> None:
    env = gymnasium.make(
        "toponav.sim.imagenav_env:toponav/ImageNav-v0",
        scene=two_rooms(),
        camera=CAMERA,
        depth=depth,
        render_mode="rgb_array",
        disable_env_checker=True,
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped)


def test_the_same_seed_gives_the_same_bytes() -> None:
    def run() -> bytes:
        env = made()
        observation, _ = env.reset(seed=11)
        parts = [np.asarray(one).tobytes() for one in observation.values()]
        for action in (1, 2, 1, 3, 1):
            observation, *_ = env.step(action)
            parts += [np.asarray(one).tobytes() for one in observation.values()]
        return b"".join(parts)

    assert run() == run()


def test_random_episodes_lie_within_the_difficulties() -> None:
    env = made()
    for seed in range(5):
        _, info = env.reset(seed=seed)
        assert 1.3 < info["distance_to_goal_m"] < 10.0


def test_an_episode_sets_start_and_goal() -> None:
    env = made()
    start, goal = Pose2(2.0, 3.0, 0.5), Pose2(8.0, 3.0, 0.0)
    _, info = env.reset(
        seed=0,
        options={"episode": ImageNavEpisode("homes-test", 2000, start, goal, 6.0, "hard")},
    )
    assert info["pose"] == start
    assert info["distance_to_goal_m"] == pytest.approx(6.0, abs=0.01)


def test_stop_terminates_with_a_reward_only_at_the_goal() -> None:
    env = made(noise=None)
    near = {"start": Pose2(7.5, 3.0, 0.0), "goal": Pose2(8.0, 3.0, 0.0)}
    env.reset(seed=0, options=near)
    _, reward, terminated, truncated, info = env.step(Action.STOP)
    assert (reward, terminated, truncated, info["success"]) == (1.0, True, False, True)
    env.reset(seed=0, options={**near, "start": Pose2(2.0, 3.0, 0.0)})
    _, reward, terminated, truncated, info = env.step(Action.STOP)
    assert (reward, terminated, truncated, info["success"]) == (0.0, True, False, False)


def test_the_last_step_truncates() -> None:
    env = made(max_steps=2)
    env.reset(seed=0)
    assert env.step(Action.LEFT)[2:4] == (False, False)
    assert env.step(Action.LEFT)[2:4] == (False, True)


def test_render_shows_the_panorama_above_the_goal() -> None:
    env = made(render_mode="rgb_array")
    observation, _ = env.reset(seed=0)
    picture = env.render()
    assert picture is not None
    assert (picture == np.concatenate([observation["rgb"], observation["goal_rgb"]])).all()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"gaol": Pose2(2.0, 3.0, 0.0)}, "goal"),
        ({"goal": Pose2(2.0, 3.0, 0.0)}, "needs a goal"),
        ({"start": Pose2(0.0, 0.0, 0.0), "goal": Pose2(2.0, 3.0, 0.0)}, "cannot be"),
    ],
)
def test_wrong_options_are_refused(options: dict[str, Pose2], message: str) -> None:
    with pytest.raises(InputError, match=message):
        made().reset(seed=0, options=options)


def test_an_unknown_render_mode_is_refused() -> None:
    with pytest.raises(InputError, match="rgb_array"):
        made(render_mode="human")


def test_the_dense_reward_adds_up_to_spl_and_the_way_made_less_a_thousandth_a_step() -> None:
    env = made(noise=None, reward="dense")
    route = {"start": Pose2(1.0, 1.0, 0.0), "goal": Pose2(2.4, 1.0, 0.0)}
    _, info = env.reset(seed=0, options=route)
    first_m, rewards = info["distance_to_goal_m"], []
    for action in (Action.FORWARD, Action.FORWARD, Action.FORWARD, Action.STOP):
        _, reward, terminated, _, info = env.step(int(action))
        rewards.append(reward)
    assert terminated
    assert info["success"]
    made_m = first_m - info["distance_to_goal_m"]
    assert sum(rewards) == pytest.approx(10.0 + made_m - 4 * 0.001, abs=1e-6)


def test_twins_share_a_building_but_no_state() -> None:
    env = made(noise=None)
    env.reset(seed=0)
    twin = env.twin()
    twin.reset(seed=1)
    before = env.simulation.state
    twin.step(int(Action.FORWARD))
    assert env.simulation.state == before
    assert twin.simulation.renderer is env.simulation.renderer


def test_an_unknown_reward_is_refused() -> None:
    with pytest.raises(InputError, match="no reward is called"):
        made(reward="shaped")
