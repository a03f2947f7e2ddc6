"""The Gymnasium environment keeps Gymnasium's rules and ours."""

import math

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from tests.sim.buildings import furnished_room
from toponav.core.camera import PinholeCamera
from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.sim import register
from toponav.sim.env import BehavioralNavEnv
from toponav.worlds.scene import Scene

CAMERA = PinholeCamera(24, 18)
AHEAD = np.array([0.5, 0.0], np.float32)
BEFORE_WALL = {"pose": Pose2(5.4, 2.5, 0.0)}


@pytest.fixture(scope="module")
def scene() -> Scene:
    return furnished_room()


@pytest.fixture
def env(scene: Scene) -> BehavioralNavEnv:
    return BehavioralNavEnv(scene, CAMERA, render_mode="rgb_array")


# Metres and radians a second are what a robot takes; they are not scaled to [-1, 1].
@pytest.mark.filterwarnings("ignore:.*symmetric and normalized space")
def test_environment_passes_the_gymnasium_checker(scene: Scene) -> None:
    register()
    register()
    env = gymnasium.make(
        "toponav/BehavioralNav-v0", scene=scene, camera=CAMERA, render_mode="rgb_array"
    )
    check_env(env.unwrapped)


def test_gymnasium_finds_the_environment_by_its_module(scene: Scene) -> None:
    env = gymnasium.make("toponav.sim.env:toponav/BehavioralNav-v0", scene=scene, camera=CAMERA)
    assert isinstance(env.unwrapped, BehavioralNavEnv)


def test_spaces_are_those_of_the_paper(scene: Scene) -> None:
    env = BehavioralNavEnv(scene)
    assert env.action_space.low.tolist() == [np.float32(-0.2), -1.5]
    assert env.action_space.high.tolist() == [0.5, 1.5]
    assert env.observation_space["depth"].shape == (240, 320)
    assert env.observation_space["depth"].high.max() == 3.5
    assert env.metadata["render_fps"] == 5


def rollout(env: BehavioralNavEnv, seed: int) -> bytes:
    observation, info = env.reset(seed=seed)
    parts = [observation["depth"].tobytes(), repr(info).encode()]
    rng = np.random.default_rng(seed)
    for _ in range(10):
        action = rng.uniform(env.action_space.low, env.action_space.high).astype(np.float32)
        observation, *rest = env.step(action)
        parts += [observation["depth"].tobytes(), repr(rest).encode()]
    return b"".join(parts)


def test_same_seed_gives_the_same_bytes(scene: Scene, env: BehavioralNavEnv) -> None:
    first = rollout(env, 3)
    assert rollout(env, 4) != first
    assert rollout(env, 3) == first
    assert rollout(BehavioralNavEnv(scene, CAMERA), 3) == first


def test_info_holds_the_truth(env: BehavioralNavEnv) -> None:
    pose = Pose2(1.0, 2.5, 0.3)
    _, info = env.reset(options={"pose": pose})
    assert info["pose"] == pytest.approx(pose)
    assert set(info) == {"pose", "velocity", "contact", "time_s"}
    *_, info = env.step(AHEAD)
    assert info["time_s"] == 0.2
    assert info["velocity"].linear_m_s > 0.1


def test_contact_ends_the_episode(env: BehavioralNavEnv) -> None:
    env.reset(options=BEFORE_WALL)
    for _ in range(10):
        observation, reward, terminated, truncated, info = env.step(AHEAD)
        if terminated:
            break
    assert (reward, terminated, truncated, info["contact"]) == (0.0, True, False, "wall")
    assert env.observation_space.contains(observation)


def test_softer_rule_lets_the_robot_push_on(scene: Scene) -> None:
    env = BehavioralNavEnv(scene, CAMERA, collisions="stuck")
    env.reset(options=BEFORE_WALL)
    steps = [env.step(AHEAD) for _ in range(10)]
    assert not any(step[2] for step in steps)
    assert steps[-1][4]["contact"] == "wall"


def test_episode_is_truncated_after_its_steps(scene: Scene) -> None:
    env = BehavioralNavEnv(scene, CAMERA, max_steps=3)
    env.reset(seed=0)
    still = np.zeros(2, np.float32)
    assert [env.step(still)[3] for _ in range(3)] == [False, False, True]


def test_random_starts_touch_nothing(env: BehavioralNavEnv) -> None:
    poses = set()
    for seed in range(12):
        _, info = env.reset(seed=seed)
        assert info["contact"] is None
        poses.add(info["pose"])
    assert len(poses) == 12


@pytest.mark.parametrize("action", [[math.nan, 0.0], [0.1, math.inf], [0.1], [0.1, 0.2, 0.3]])
def test_action_that_is_no_command_is_refused(env: BehavioralNavEnv, action: list[float]) -> None:
    env.reset(seed=0)
    with pytest.raises(InputError, match=r"two finite numbers.*Remedy: stop the robot"):
        env.step(np.array(action, np.float32))


def test_step_before_reset_is_refused(env: BehavioralNavEnv) -> None:
    with pytest.raises(InputError, match="call reset"):
        env.step(AHEAD)


def test_picture_is_near_red_to_far_blue(env: BehavioralNavEnv) -> None:
    assert env.render() is None
    observation, _ = env.reset(options={"pose": Pose2(0.5, 2.0, 0.0)})
    picture = env.render()
    assert picture.shape == (18, 24, 3)
    nearest = np.unravel_index(observation["depth"].argmin(), (18, 24))
    farthest = np.unravel_index(observation["depth"].argmax(), (18, 24))
    assert int(picture[nearest][0]) > int(picture[nearest][2])
    assert int(picture[farthest][2]) > int(picture[farthest][0])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"collisions": "fatale"}, "did you mean 'fatal'"),
        ({"render_mode": "human"}, "rgb_array"),
        ({"max_steps": 0}, "at least 1"),
        ({"backend": "grids"}, "did you mean 'grid'"),
    ],
)
def test_wrong_arguments_name_the_remedy(scene: Scene, arguments: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        BehavioralNavEnv(scene, CAMERA, **arguments)


def test_unknown_option_is_refused(env: BehavioralNavEnv) -> None:
    with pytest.raises(InputError, match="did you mean 'pose'"):
        env.reset(options={"poses": MIDDLE_OF_NOWHERE})


MIDDLE_OF_NOWHERE = Pose2(0.0, 0.0, 0.0)


def test_default_building_is_a_generated_office() -> None:
    env = BehavioralNavEnv(camera=CAMERA)
    observation, info = env.reset(seed=0)
    assert env.scene.provenance.generator == "office"
    assert env.observation_space.contains(observation)
    assert info["contact"] is None
