"""The environment gives colours, classes and a sensor's errors to whoever asks."""

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from tests.sim.buildings import furnished_room
from toponav.core.camera import PanoramaCamera, PinholeCamera
from toponav.core.episode import Velocity
from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.sim import register
from toponav.sim.env import BehavioralNavEnv
from toponav.sim.simulation import Simulation

CAMERA = PinholeCamera(width=16, height=12)
ALL = ("rgb", "depth", "semantic", "instance")
POSE = Pose2(1.5, 2.0, 0.3)


@pytest.mark.filterwarnings("ignore:.*symmetric and normalized space")
@pytest.mark.parametrize("camera", [CAMERA, PanoramaCamera(height=8, width=32)])
def test_environment_with_images_passes_the_gymnasium_checker(camera: object) -> None:
    register()
    env = gymnasium.make(
        "toponav/BehavioralNav-v0",
        scene=furnished_room(),
        camera=camera,
        modalities=ALL,
        sensor="kinect_v1",
        render_mode="rgb_array",
        max_steps=20,
    )
    check_env(env.unwrapped)


def test_observation_holds_what_was_asked_for_and_no_more() -> None:
    env = BehavioralNavEnv(furnished_room(), camera=CAMERA, modalities=("rgb", "semantic"))
    seen, _ = env.reset(seed=0)
    assert list(seen) == ["rgb", "semantic"]
    assert seen["rgb"].shape == (12, 16, 3)
    assert env.observation_space.contains(seen)


def test_picture_is_the_colour_image_where_there_is_one() -> None:
    env = BehavioralNavEnv(
        furnished_room(), camera=CAMERA, modalities=("rgb",), render_mode="rgb_array"
    )
    seen, _ = env.reset(seed=0)
    np.testing.assert_array_equal(env.render(), seen["rgb"])


def test_asking_for_colour_leaves_depth_what_it_was() -> None:
    plain, coloured = (
        BehavioralNavEnv(furnished_room(), camera=CAMERA, modalities=modalities)
        for modalities in (("depth",), ALL)
    )
    first, _ = plain.reset(seed=3)
    second, _ = coloured.reset(seed=3)
    assert np.mean(np.abs(first["depth"] - second["depth"]) > 1e-3) < 0.02


def test_sensor_errs_alike_for_one_seed_and_otherwise_for_another() -> None:
    def drive(seed: int) -> list[bytes]:
        env = BehavioralNavEnv(furnished_room(), camera=CAMERA, sensor="realsense_d435")
        images = [env.reset(seed=seed, options={"pose": POSE})[0]["depth"]]
        images += [env.step(np.zeros(2, np.float32))[0]["depth"] for _ in range(2)]
        return [image.tobytes() for image in images]

    assert drive(1) == drive(1)
    assert drive(1) != drive(2)
    assert len(set(drive(1))) == 3, "a robot at rest sees new noise at every step"


def test_looking_twice_at_one_step_shows_the_same() -> None:
    from toponav.sim.sensor_noise import depth_sensor

    simulation = Simulation(furnished_room(), CAMERA, sensor=depth_sensor("kinect_v1"))
    simulation.reset(POSE)
    simulation.step(Velocity(0.2, 0.0))
    first, again = simulation.observe().depth_m, simulation.observe().depth_m
    np.testing.assert_array_equal(first, again)
    assert first.max() <= CAMERA.max_depth_m


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"modalities": ("colour",)}, "no modality is called 'colour'"),
        ({"modalities": ()}, "at least one"),
        ({"sensor": "kinect"}, "did you mean 'kinect_v"),
    ],
)
def test_wrong_images_name_the_remedy(arguments: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        BehavioralNavEnv(furnished_room(), camera=CAMERA, **arguments)
