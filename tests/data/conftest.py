"""A tiny building and a finished dataset in it, made once; tests change copies."""

import shutil
from pathlib import Path

import pytest

from tests.data.small_office import save_building
from toponav.core.camera import PinholeCamera
from toponav.data.collect import CollectConfig, collect
from toponav.data.noise import NoiseConfig

EPISODES = 4


@pytest.fixture(scope="session")
def building(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return save_building(tmp_path_factory.mktemp("building"))


@pytest.fixture(scope="session")
def config(building: Path) -> CollectConfig:
    return CollectConfig(
        episodes=EPISODES,
        seed=5,
        buildings=(str(building),),
        episodes_per_building=2,
        camera=PinholeCamera(80, 60),
        noise=NoiseConfig(2.0),
    )


@pytest.fixture(scope="session")
def finished(config: CollectConfig, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished dataset; do not change it."""
    out = tmp_path_factory.mktemp("dataset") / "finished"
    collect(out, config)
    return out


@pytest.fixture
def dataset(finished: Path, tmp_path: Path) -> Path:
    """A copy that a test may damage."""
    return Path(shutil.copytree(finished, tmp_path / "dataset"))
