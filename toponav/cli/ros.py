"""`toponav ros`: the simulator and the agents as ROS 2 nodes, recordings as bags."""

import json as json_module
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from toponav.core.errors import InputError

if TYPE_CHECKING:
    from toponav.core.geometry import Pose2
    from toponav.maps.spec import TopologicalMap
    from toponav.ros.presets import RobotPreset
    from toponav.worlds.scene import Scene

__all__ = ["register", "ros_agent", "ros_go", "ros_messages", "ros_record", "ros_sim"]

_Flag = Annotated[bool, tyro.conf.FlagCreatePairsOff]
_Name = Annotated[str, tyro.conf.Positional]
_Robot = Literal["toponav", "turtlebot4", "turtlebot3", "locobot"]


def register() -> dict[tuple[str, ...], Callable[..., Any]]:
    """The commands of this module."""
    return {
        ("ros", "sim"): ros_sim,
        ("ros", "agent"): ros_agent,
        ("ros", "go"): ros_go,
        ("ros", "record"): ros_record,
        ("ros", "messages"): ros_messages,
    }


def ros_sim(
    *,
    scene: Path,
    map: Path | None = None,
    start: str | None = None,
    pose: tuple[float, float, float] | None = None,
    robot: _Robot = "toponav",
    color: _Flag = False,
    panorama: _Flag = False,
    rate: float = 1.0,
    lockstep: _Flag = False,
    paused: _Flag = False,
    fault: Annotated[tuple[str, ...], tyro.conf.UseAppendAction] = (),
    seed: int = 0,
    seconds: float | None = None,
    report: Path | None = None,
) -> int:
    """Run the simulator as a ROS 2 robot: depth, odometry, tf, map and bumper out, cmd_vel in.

    Example: toponav ros sim --scene office --map office.topo.json --start office_1

    A Stanford area, with the authors' map: toponav ros sim --scene area_3.yaml --start office_1

    Args:
        scene: Folder of a scene, or an area's yaml.
        map: Topological map, for --start. An area brings its own.
        start: Node that the robot stands at, looking along its first edge.
        pose: x and y in metres and yaw in radians, instead of a node.
        robot: Whose topic names to use.
        color: Publish colour images too.
        panorama: Carry a camera that sees all around, for agents that look for pictures.
        rate: Simulated seconds per second; 0 is as fast as it can.
        lockstep: Step only when a command has answered the last frame.
        paused: Begin paused; ~/step advances.
        fault: What is wrong with the camera: drop:0.2, delay:0.3, nan:0.2, frozen:0.2. Repeat.
        seed: Seed of the faults.
        seconds: End after so much simulated time.
        report: At the end, write latencies, contacts and late ticks to this JSON file.
    """
    from toponav.ros.faults import parse_faults

    faults = parse_faults(fault)
    if rate < 0:
        raise InputError(f"a rate is not negative: {rate}", where="--rate", remedy="give 1 or 0")
    _start()
    from toponav.core.camera import PanoramaCamera
    from toponav.ros.presets import robot_preset
    from toponav.ros.runtime import ros_context
    from toponav.ros.sim_node import SimNode, SimNodeConfig
    from toponav.sim.simulation import Simulation

    loaded = _scene(scene)
    at = _start_pose(loaded, _map(map or scene) if map or _is_yaml(scene) else None, start, pose)
    preset = _with_panorama(robot_preset(robot)) if panorama else robot_preset(robot)
    config = SimNodeConfig(preset, rate, lockstep, faults, seed, paused)
    simulation = Simulation(
        loaded,
        PanoramaCamera() if panorama else _camera(robot_preset("toponav")),
        modalities=("depth", "rgb") if color or panorama else ("depth",),
    )
    with ros_context():
        node = SimNode(simulation, at, config)
        print(f"simulating {loaded.name}; Ctrl-C ends it", file=sys.stderr)
        with suppress(KeyboardInterrupt):
            node.run(lambda: seconds is not None and node.robot.time_ns >= seconds * 1e9)
        if report is not None:
            _write_report(node, report)
    return 0


def ros_agent(
    *,
    map: Path | None = None,
    agent: str = "graphnav_pf",
    image_agent: str | None = None,
    weights: str | None = None,
    robot: _Robot = "toponav",
    sim_time: _Flag = False,
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
    preset = _preset(
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
        return _serve_images(image_agent, weights, _with_panorama(preset), sim_time)
    loaded = _map(map)
    _start()
    import torch

    torch.set_num_threads(1)
    from toponav.ros.agent_node import AgentNode, AgentNodeConfig
    from toponav.ros.agents import load_plan_agent
    from toponav.ros.runtime import favor_latency, ros_context

    with ros_context():
        node = AgentNode(
            loaded,
            lambda camera: load_plan_agent(agent, weights, camera),
            _camera(preset),
            AgentNodeConfig(preset, sim_time),
        )
        favor_latency()
        print(f"{agent} is ready on map {loaded.name}; Ctrl-C ends it", file=sys.stderr)
        with suppress(KeyboardInterrupt):
            node.run()
    return 0


def _serve_images(name: str, weights: str | None, preset: "RobotPreset", sim_time: bool) -> int:
    from toponav.ros.agents import IMAGE_AGENTS, load_image_agent

    _start()
    agent = load_image_agent(name, weights)
    from toponav.ros.image_node import ImageNode
    from toponav.ros.runtime import ros_context

    with ros_context():
        node = ImageNode(lambda: agent, preset, IMAGE_AGENTS.get(name, True), sim_time)
        print(f"{name} is ready; Ctrl-C ends it", file=sys.stderr)
        with suppress(KeyboardInterrupt):
            node.run()
    return 0


def ros_go(
    goal: _Name,
    *,
    start: str,
    seed: int = 0,
    timeout_s: float = 30.0,
    json: _Flag = False,
) -> int:
    """Send a robot that `toponav ros agent` drives to a node or room, and follow it there.

    Example: toponav ros go office_12 --start office_1

    Ctrl-C cancels the drive and stops the robot. Exit status 1 if it does not arrive.

    Args:
        goal: Node or room to reach.
        start: Node that the robot stands at, looking along the plan's first edge.
        seed: Seed of the agent's random numbers.
        timeout_s: How long to wait for an agent.
        json: Print the result as JSON.
    """
    _start()
    from toponav.ros.client import go
    from toponav.ros.runtime import ros_context

    def show(line: str) -> None:
        print(line, file=sys.stderr)

    with ros_context():
        result = go(start, goal, seed=seed, timeout_s=timeout_s, on_feedback=show)
    if json:
        print(json_module.dumps(result))
    else:
        print(f"{result['outcome']}: {result['reason']} ({result['progress']:.0%} of the plan)")
    return 0 if result["success"] else 1


def ros_record(
    *,
    map: Path,
    start: str,
    goal: str,
    out: Path,
    building: str = "floor",
    robot: _Robot = "toponav",
    sim_time: _Flag = False,
    seconds: float | None = None,
    outcome: Literal["success", "collided", "stuck", "timeout"] = "success",
) -> int:
    """Record a drive as a bag like those of `toponav collect`: depth, poses, commands at 5 Hz.

    Example: toponav ros record --map office.topo.json --start office_1 --goal office_12
    --out bags/000.mcap --robot turtlebot4

    Ctrl-C ends it and writes the file. `toponav data import-bag` makes a dataset of bags.

    Args:
        map: Topological map, or an area's yaml.
        start: Node that the robot stands at when the recording begins.
        goal: Node or room that it is driven to.
        out: The bag to write, ending in .mcap.
        building: Name of the building in the bag's metadata.
        robot: Topic names of a known robot.
        sim_time: Take time from /clock.
        seconds: End after so long.
        outcome: How the drive ended, for the metadata.
    """
    from toponav.core.files import check_out_file
    from toponav.ros.tasks import task_of_goal

    if out.suffix != ".mcap":
        raise InputError("a bag's name ends in .mcap", where=f"--out {out}", remedy="rename it")
    check_out_file(out)
    task = task_of_goal(_map(map), start=start, goal=goal)
    preset = _preset(robot)
    _start()
    from toponav.ros.record_node import RecordNode
    from toponav.ros.runtime import ros_context

    with ros_context():
        node = RecordNode(task, _camera(preset), preset, out, building, sim_time)
        print(f"recording to {out}; Ctrl-C ends it", file=sys.stderr)
        with suppress(KeyboardInterrupt):
            node.run(seconds)
        frames = node.finish(outcome)
    print(f"{frames} frames in {out}")
    return 0


def ros_messages() -> int:
    """Build the ROS messages that have no wheel, once; other commands do it when needed.

    Example: toponav ros messages
    """
    from toponav.ros.interfaces import PACKAGES, cache_dir

    taken = _start()
    for package in PACKAGES:
        where = f"built in {cache_dir()}" if package in taken else "of this ROS 2"
        print(f"{package}: {where}")
    return 0


def _start() -> tuple[str, ...]:
    """Find ROS 2, build messages where they are missing; this process may start again."""
    from toponav.ros.environment import prepare
    from toponav.ros.interfaces import load_interfaces

    def tell(package: str) -> None:
        print(f"building the messages of {package}, once (about ten seconds)...", file=sys.stderr)

    return load_interfaces(prepare(), tell)


def _is_yaml(path: Path) -> bool:
    return path.suffix in (".yaml", ".yml")


def _scene(path: Path) -> "Scene":
    from toponav.cli._map_files import load_building

    return load_building(path)


def _map(path: Path) -> "TopologicalMap":
    from toponav.cli._map_files import load_any_map

    return load_any_map(path)


def _start_pose(
    scene: "Scene",
    map_: "TopologicalMap | None",
    start: str | None,
    pose: tuple[float, float, float] | None,
) -> "Pose2":
    from toponav.core.geometry import Pose2

    if pose is not None:
        return Pose2(*pose)
    if start is None or map_ is None:
        raise InputError(
            "where the robot stands must be said",
            where="toponav ros sim",
            remedy="give --map MAP --start NODE, or --pose X Y YAW",
        )
    node, exits = map_.node(start), map_.out_edges(start)
    from toponav.worlds.free_space import FreeSpace

    free = FreeSpace.of(scene, 0.25)
    x_m, y_m = node.x_m, node.y_m
    if not free.is_free(x_m, y_m):
        x_m, y_m = scene.grid.center_of(*free.nearest_free(x_m, y_m))
    return Pose2(x_m, y_m, exits[0].yaw_rad if exits else 0.0)


def _preset(
    robot: str,
    depth: str | None = None,
    info: str | None = None,
    cmd_vel: str | None = None,
    camera_height_m: float | None = None,
    max_linear_m_s: float | None = None,
    max_angular_rad_s: float | None = None,
) -> "RobotPreset":
    import dataclasses

    from toponav.ros.presets import robot_preset

    preset = robot_preset(robot)
    limits = preset.limits
    for name, wanted in (("linear_m_s", max_linear_m_s), ("angular_rad_s", max_angular_rad_s)):
        if wanted is not None:
            if not 0 < wanted <= getattr(limits, name):
                raise InputError(
                    f"at most {getattr(limits, name)} for {robot}, and more than 0; got {wanted}",
                    where=f"--max-{name.replace('_', '-')}",
                    remedy="leave it out, or choose a robot that is faster",
                )
            limits = dataclasses.replace(limits, **{name: wanted})
    changes: dict[str, Any] = {"depth": depth, "camera_info": info, "cmd_vel": cmd_vel}
    changes["camera_height_m"] = camera_height_m
    given = {name: value for name, value in changes.items() if value is not None}
    return dataclasses.replace(preset, limits=limits, **given)


def _with_panorama(preset: "RobotPreset") -> "RobotPreset":
    import dataclasses

    return dataclasses.replace(preset, rgb="/panorama/image_raw", depth="/panorama/depth")


def _camera(preset: "RobotPreset") -> Any:
    """GraphNav's camera at this robot's height: what the networks were trained with."""
    from toponav.core.camera import PinholeCamera

    return PinholeCamera(mount_height_m=preset.camera_height_m)


def _write_report(node: Any, path: Path) -> None:
    from toponav.core.files import write_atomically

    facts = {
        "simulated_s": node.robot.time_ns / 1e9,
        "ticks": node.ticks,
        "late_ticks": node.late_ticks,
        "contacts": node.contacts,
        "latencies_ms": [round(each, 3) for each in node.latencies_ms],
    }
    write_atomically(path, json_module.dumps(facts) + "\n")
