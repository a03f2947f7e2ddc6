"""Marks what needs rclpy, and keeps tests of several people on one machine apart."""

import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def ros(tmp_path_factory: pytest.TempPathFactory) -> None:
    """ROS 2 with every message package, in a domain of this process."""
    pytest.importorskip("rclpy", reason="ROS 2 is not installed; `make test-ros` installs it")
    from toponav.ros.environment import find_ros
    from toponav.ros.interfaces import load_interfaces

    os.environ["ROS_DOMAIN_ID"] = str(20 + os.getpid() % 70)
    os.environ["ROS_LOG_DIR"] = str(tmp_path_factory.mktemp("ros_log"))
    load_interfaces(find_ros())


@pytest.fixture
def area_3(areas_dir: Path) -> Path:
    """The third area of Stanford 2D-3D-S."""
    return areas_dir / "area_3.yaml"
