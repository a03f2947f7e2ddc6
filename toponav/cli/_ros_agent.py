"""`toponav ros agent`: GraphNav and its baselines, or NTS, driving a robot."""

import sys
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from toponav.cli._map_files import load_any_map
from toponav.cli._ros_setup import (
    Flag,
    Robot,
    preset_of,
    start_ros,
    trained_camera,
    with_panorama,
)
from toponav.core.errors import InputError

if TYPE_CHECKING:
    from toponav.ros.presets import RobotPreset

__all__ = ["ros_agent"]


def ros_agent(
    *,
    map: Path | None = None,
    agent: str = "graphnav_pf",
    image_agent: str | None = None,
    weights: str | None = None,
    robot: Robot = "toponav",
    sim_time: Flag = False,
    depth_topic: str | None = None,
    info_topic: str | None = None,
    cmd_vel_topic: str | None = None,
    camera_height_m: float | None = None,
    max_linear_m_s: float | None = None,
    max_angular_rad_s: float | None = None,
) -> int:
    """Drive a robot: serve FollowPlan by depth camera and map, or GoToImage by panorama.

    Against the simulator: toponav ros agent --map office.topo.json --sim-time

    On a TurtleBot 4: toponav ros agent --map office.topo.json --robot turtlebot4

    The robot stands still whenever there is no fresh depth for 0.5 s, frames are NaN or frozen,
    or the agent does not answer. `toponav ros go` sends it somewhere.

    Args:
        map: Topological map, or an area's yaml.
        agent: graphnav_pf, graphnav, phasenet, behavrnn, or your own as module:factory.
        image_agent: Serve GoToImage instead, with nts_rgbd, nts_rgb, or your own as
            module:factory; no map is needed.
        weights: Folder of other weights, or a preset. What ships, if left out.
        robot: Topic names, camera height and speed limits of a known robot.
        sim_time: Take time from /clock.
        depth_topic: Depth images, 32FC1 or 16UC1, if not the preset's.
        info_topic: Their camera_info, if not the preset's.
        cmd_vel_topic: Where commands go, if not the preset's.
        camera_height_m: Height of the camera above the floor, if not the preset's.
        max_linear_m_s: Top speed, if lower than the preset's.
        max_angular_rad_s: Top turn rate, if lower than the preset's.
    """
    preset = preset_of(
        robot, depth_topic, info_topic, cmd_vel_topic, camera_height_m, max_linear_m_s,
        max_angular_rad_s,
    )  # fmt: skip
    if (map is None) == (image_agent is None):
        raise InputError(
            "an agent follows plans on a map, or looks for pictures",
            where="toponav ros agent",
            remedy="give --map MAP, or --image-agent nts_rgbd",
        )
    if map is None:
        assert image_agent is not None
        return _serve_images(image_agent, weights, with_panorama(preset), sim_time)
    loaded = load_any_map(map)
    start_ros()
    import torch

    torch.set_num_threads(1)
    from toponav.ros.agent_node import AgentNode, AgentNodeConfig
    from toponav.ros.agents import load_plan_agent
    from toponav.ros.runtime import favor_latency, ros_context

    with ros_context():
        node = AgentNode(
            loaded,
            lambda camera: load_plan_agent(agent, weights, camera),
            trained_camera(preset),
            AgentNodeConfig(preset, sim_time),
        )
        favor_latency()
        print(f"{agent} is ready on map {loaded.name}; Ctrl-C ends it", file=sys.stderr)
        with suppress(KeyboardInterrupt):
            node.run()
    return 0


def _serve_images(name: str, weights: str | None, preset: "RobotPreset", sim_time: bool) -> int:
    from toponav.ros.agents import IMAGE_AGENTS, load_image_agent

    start_ros()
    agent = load_image_agent(name, weights)
    from toponav.ros.image_node import ImageNode
    from toponav.ros.runtime import favor_latency, ros_context

    with ros_context():
        node = ImageNode(lambda: agent, preset, IMAGE_AGENTS.get(name, True), sim_time)
        favor_latency()
        print(f"{name} is ready; Ctrl-C ends it", file=sys.stderr)
        with suppress(KeyboardInterrupt):
            node.run()
    return 0
