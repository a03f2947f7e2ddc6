"""Agents that the ROS nodes drive with; no ROS is needed to load them."""

import pytest

from toponav.core.camera import PinholeCamera
from toponav.core.errors import InputError
from toponav.core.imagenav import ImageNavAgent
from toponav.navigation.graphnav.metric_agent import MetricGraphNavAgent
from toponav.ros.agents import load_image_agent, load_plan_agent


@pytest.mark.parametrize("name", ["nts_rgb", "nts_rgbd"])
def test_shipped_agents_look_for_pictures(name):
    assert isinstance(load_image_agent(name, None), ImageNavAgent)


def test_robots_drive_with_the_weights_that_everything_else_does():
    assert isinstance(load_plan_agent("graphnav_pf", None, PinholeCamera()), MetricGraphNavAgent)


def test_unknown_agents_are_refused():
    with pytest.raises(InputError, match="nts_rgb"):
        load_image_agent("nts_rgbb", None)
