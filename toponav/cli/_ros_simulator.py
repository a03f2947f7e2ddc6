"""`toponav ros sim`: the simulator as a robot."""

import json as json_module
import sys
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from toponav.cli._map_files import is_yaml, load_any_map, load_building
from toponav.cli._ros_setup import Flag, Robot, start_ros, trained_camera, with_panorama
from toponav.core.errors import InputError

if TYPE_CHECKING:
    from toponav.core.geometry import Pose2
    from toponav.maps.spec import TopologicalMap
    from toponav.worlds.scene import Scene

__all__ = ["ros_sim"]


def ros_sim(
    *,
    scene: Path,
    map: Path | None = None,
    start: str | None = None,
    pose: tuple[float, float, float] | None = None,
    robot: Robot = "toponav",
    color: Flag = False,
    panorama: Flag = False,
    rate: float = 1.0,
    lockstep: Flag = False,
    paused: Flag = False,
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
        robot: Whose topic names and camera height to use.
        color: Publish colour images too.
        panorama: Carry a camera that sees all around, for agents that look for pictures.
        rate: Simulated seconds per second, at most; 0 is as fast as it can.
        lockstep: Let time stand still until a command has answered the last frame.
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
    start_ros()
    from toponav.core.camera import PanoramaCamera
    from toponav.ros.presets import robot_preset
    from toponav.ros.runtime import ros_context
    from toponav.ros.sim_node import SimNode, SimNodeConfig
    from toponav.sim.simulation import Simulation

    loaded = load_building(scene)
    at = _start_pose(
        loaded, load_any_map(map or scene) if map or is_yaml(scene) else None, start, pose
    )
    preset = with_panorama(robot_preset(robot)) if panorama else robot_preset(robot)
    config = SimNodeConfig(preset, rate, lockstep, faults, seed, paused)
    simulation = Simulation(
        loaded,
        PanoramaCamera() if panorama else trained_camera(preset),
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
