"""MuJoCo models of a robot in a building: wheels on a floor among static boxes."""

from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Int, UInt8

from toponav.sim.robots import TURTLEBOT2, DifferentialRobot
from toponav.worlds.extrude import merge_rectangles
from toponav.worlds.scene import Scene, SemanticClass

__all__ = ["BuildingModel", "build_model"]

_HEIGHT_BAND_M = 0.05
_BOUNDARY_M = 0.5
# A motor's rotor seen through its gear. Without it a wheel is so light that the velocity
# servo's implicit damping and the friction solver disagree, and the robot overshoots.
_ROTOR_KG_M2 = 0.002


@dataclass(frozen=True)
class BuildingModel:
    """A compiled model, and where its parts are.

    Attributes:
        model: The MuJoCo model; never changed after it is built, so simulations may share it.
        robot: The robot in it.
        body_geom: Number of the geom that can touch the building.
        box_semantic: `SemanticClass` of what each geom stands for (`FLOOR` for the robot's).
    """

    model: mujoco.MjModel
    robot: DifferentialRobot
    body_geom: int
    box_semantic: UInt8[np.ndarray, " geoms"]


def build_model(
    scene: Scene, robot: DifferentialRobot = TURTLEBOT2, timestep_s: float = 0.004
) -> BuildingModel:
    """The robot on an endless floor, with a box for each merged rectangle of obstacle cells.

    Cells merge when they hold the same class at about the same height; all heights that
    reach over the robot count as one. Four more boxes close the grid's edge.

    Args:
        scene: The building.
        robot: The robot.
        timestep_s: Step of the physics.
    """
    spec = mujoco.MjSpec.from_string(_robot_xml(robot, timestep_s))
    world = spec.worldbody
    for number, (low_m, high_m) in enumerate(_boundary(scene)):
        _add_box(world, f"boundary_{number}", low_m, high_m, 2.0)
    for semantic, height_m, rectangles in _bands(scene, robot):
        for number, (row0, col0, row1, col1) in enumerate(rectangles.tolist()):
            corner = np.array([[col0, row0], [col1, row1]]) * scene.grid.resolution_m
            low_m, high_m = corner + np.asarray(scene.grid.origin_m)
            name = f"box_{semantic}_{round(height_m * 1000)}_{number}"
            _add_box(world, name, low_m, high_m, height_m)
    model = spec.compile()
    names = [model.geom(geom).name for geom in range(model.ngeom)]
    return BuildingModel(
        model=model,
        robot=robot,
        body_geom=names.index("body"),
        box_semantic=np.array([_semantic_of(name) for name in names], dtype=np.uint8),
    )


def _semantic_of(geom_name: str) -> int:
    kind, _, rest = geom_name.partition("_")
    if kind == "boundary":
        return int(SemanticClass.WALL)
    return int(rest.split("_")[0]) if kind == "box" else int(SemanticClass.FLOOR)


def _bands(
    scene: Scene, robot: DifferentialRobot
) -> list[tuple[int, float, Int[np.ndarray, "rectangles 4"]]]:
    """Class, height and merged rectangles of each kind of obstacle."""
    tall_m = robot.height_m + _HEIGHT_BAND_M
    rounded = np.ceil(scene.heights_m / _HEIGHT_BAND_M - 1e-4) * _HEIGHT_BAND_M
    heights_m = np.where(scene.heights_m >= tall_m, scene.ceiling_m, rounded)
    heights_m = np.where(scene.occupied, heights_m, 0.0)
    bands = []
    for semantic in np.unique(scene.semantics[scene.occupied]).tolist():
        of_class = scene.occupied & (scene.semantics == semantic)
        for height_m in np.unique(heights_m[of_class]).tolist():
            rectangles = merge_rectangles(of_class & (heights_m == height_m))
            bands.append((int(semantic), float(height_m), np.asarray(rectangles)))
    return bands


def _boundary(scene: Scene) -> list[tuple[np.ndarray, np.ndarray]]:
    """Lower-left and upper-right corners of boxes along the grid's four edges."""
    left, right, bottom, top = scene.grid.extent_m
    out = _BOUNDARY_M
    corners = [
        (left - out, bottom - out, left, top + out),
        (right, bottom - out, right + out, top + out),
        (left, bottom - out, right, bottom),
        (left, top, right, top + out),
    ]
    return [(np.array(corner[:2]), np.array(corner[2:])) for corner in corners]


def _add_box(
    world: mujoco.MjsBody, name: str, low_m: np.ndarray, high_m: np.ndarray, height_m: float
) -> None:
    middle = (low_m + high_m) / 2
    half = (high_m - low_m) / 2
    world.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        pos=[middle[0], middle[1], height_m / 2],
        size=[half[0], half[1], height_m / 2],
    )


def _robot_xml(robot: DifferentialRobot, timestep_s: float) -> str:
    """The robot and the floor. The robot's frame is on the axle, midway between its wheels."""
    r = robot.wheel_radius_m
    half_body = (robot.height_m - robot.clearance_m) / 2
    body_mass = robot.mass_kg - 2 * robot.wheel_mass_kg
    across = body_mass * (3 * robot.radius_m**2 + (2 * half_body) ** 2) / 12
    around = body_mass * robot.radius_m**2 / 2
    wheel_across = robot.wheel_mass_kg * (3 * r**2 + robot.wheel_width_m**2) / 12
    wheel_around = robot.wheel_mass_kg * r**2 / 2
    wheels = "".join(
        f"""
        <body name="{side}_wheel" pos="0 {sign * robot.wheel_separation_m / 2} 0">
          <inertial pos="0 0 0" mass="{robot.wheel_mass_kg}"
                    diaginertia="{wheel_across} {wheel_around} {wheel_across}"/>
          <joint name="{side}" type="hinge" axis="0 1 0" armature="{_ROTOR_KG_M2}"/>
          <geom name="{side}_wheel" type="ellipsoid" size="{r} {robot.wheel_width_m / 2} {r}"
                contype="0" conaffinity="0"/>
        </body>"""
        for side, sign in (("left", 1), ("right", -1))
    )
    casters = "".join(
        f"""
        <geom name="{end}_caster" type="sphere" size="{robot.caster_radius_m}"
              pos="{sign * robot.caster_offset_m} 0 {robot.caster_radius_m - r}"
              contype="0" conaffinity="0"/>"""
        for end, sign in (("front", 1), ("rear", -1))
    )
    # Named pairs, so that only the body is looked for among the building's boxes.
    floor_contacts = "".join(
        f'<pair geom1="floor" geom2="{geom}" {kind}/>'
        for geom, kind in (
            ("left_wheel", 'condim="4" friction="1 1 0.001 0.0001 0.0001"'),
            ("right_wheel", 'condim="4" friction="1 1 0.001 0.0001 0.0001"'),
            ("front_caster", 'condim="1"'),
            ("rear_caster", 'condim="1"'),
        )
    )
    motors = "".join(
        f'<velocity name="{side}" joint="{side}" kv="0.5" forcerange="-3 3"/>'
        for side in ("left", "right")
    )
    return f"""
    <mujoco model="robot in a building">
      <option timestep="{timestep_s}" integrator="implicitfast" cone="pyramidal">
        <flag autoreset="disable" sleep="enable"/>
      </option>
      <worldbody>
        <geom name="floor" type="plane" size="0 0 1" contype="0" conaffinity="0"/>
        <body name="base" pos="0 0 {r}">
          <freejoint/>
          <inertial pos="0 0 {r}" mass="{body_mass}" diaginertia="{across} {across} {around}"/>
          <geom name="body" type="cylinder" size="{robot.radius_m} {half_body}"
                pos="0 0 {robot.clearance_m + half_body - r}" condim="3"
                friction="0.3 0.001 0.0001"/>
          {casters}
          {wheels}
        </body>
      </worldbody>
      <contact>{floor_contacts}</contact>
      <actuator>{motors}</actuator>
      <sensor><contact name="touch" geom1="body" data="found" num="1"/></sensor>
    </mujoco>"""
