"""A building of two rooms, in every format that we read."""

import json
import struct
import zipfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import trimesh

__all__ = [
    "BOXES",
    "dae_text",
    "home_xml",
    "obj_text",
    "one_mesh",
    "sdf_text",
    "write_glb",
    "write_sh3d",
    "write_sh3f",
]

# Middle and size in metres: 8 m by 4 m, a wall across at x = 5 with a door of 0.9 m, a table
# that a robot drives under and a chest that it does not.
BOXES: dict[str, tuple[tuple[float, float, float], tuple[float, float, float]]] = {
    "floor": ((4.0, 2.0, -0.05), (8.2, 4.2, 0.1)),
    "ceiling": ((4.0, 2.0, 2.55), (8.2, 4.2, 0.1)),
    "wall_south": ((4.0, -0.05, 1.25), (8.2, 0.1, 2.5)),
    "wall_north": ((4.0, 4.05, 1.25), (8.2, 0.1, 2.5)),
    "wall_west": ((-0.05, 2.0, 1.25), (0.1, 4.0, 2.5)),
    "wall_east": ((8.05, 2.0, 1.25), (0.1, 4.0, 2.5)),
    "wall_a": ((5.0, 0.75, 1.25), (0.1, 1.5, 2.5)),
    "wall_b": ((5.0, 3.2, 1.25), (0.1, 1.6, 2.5)),
    "wall_lintel": ((5.0, 1.95, 2.3), (0.1, 0.9, 0.4)),
    "table_top": ((2.0, 3.0, 0.72), (1.2, 0.8, 0.04)),
    "chest": ((7.5, 3.6, 0.4), (0.8, 0.6, 0.8)),
}


def _box(name: str) -> trimesh.Trimesh:
    middle, size = BOXES[name]
    box = trimesh.creation.box(size)
    box.apply_translation(middle)
    return box


def one_mesh() -> trimesh.Trimesh:
    """All of it as one mesh without names, z up, in metres."""
    return trimesh.util.concatenate([_box(name) for name in BOXES])


def obj_text(names: Mapping[str, str] | None = None, *, as_materials: bool = False) -> str:
    """As OBJ, z up; objects (or materials) are called as `names` says, else part_1, part_2, ..."""
    lines = ["# two rooms"]
    before = 1
    for number, key in enumerate(BOXES):
        box = _box(key)
        name = names[key] if names else f"part_{number}"
        lines.append(f"usemtl {name}" if as_materials else f"o {name}")
        lines += [f"v {x:.5f} {y:.5f} {z:.5f}" for x, y, z in box.vertices]
        lines += ["f " + " ".join(str(v + before) for v in face) for face in box.faces]
        before += len(box.vertices)
    return "\n".join(lines) + "\n"


def write_glb(path: Path) -> None:
    """As GLB: y up, named nodes, a texture on the table."""
    from PIL import Image

    scene = trimesh.Scene()
    y_up = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
    for name in BOXES:
        box = _box(name)
        if name == "table_top":
            box.visual = trimesh.visual.TextureVisuals(
                uv=np.zeros((len(box.vertices), 2)),
                material=trimesh.visual.material.PBRMaterial(
                    name="oak", baseColorTexture=Image.new("RGB", (8, 8), (200, 10, 10))
                ),
            )
        scene.add_geometry(box, node_name=name, geom_name=name, transform=y_up)
    path.write_bytes(scene.export(file_type="glb"))


def sdf_text(more: str = "") -> str:
    """As a Gazebo world of boxes in one model, with nested poses, on a ground plane."""
    visuals = []
    for name, ((x, y, z), (a, b, c)) in BOXES.items():
        if name != "floor":
            # The model lies 1 m along x and its link turned by 90 degrees.
            visuals.append(
                f"<link name='{name}'><pose>{y} {1 - x} {z} 0 0 -1.5707963267948966</pose>"
                f"<visual name='{name}'><geometry><box><size>{a} {b} {c}</size></box></geometry>"
                "</visual></link>"
            )
    return (
        "<?xml version='1.0'?><sdf version='1.7'><world name='w'>"
        "<model name='ground_plane'><link name='l'><visual name='v'><geometry><plane>"
        "<normal>0 0 1</normal><size>100 100</size></plane></geometry></visual></link></model>"
        f"<model name='rooms'><pose>1 0 0 0 0 1.5707963267948966</pose>{''.join(visuals)}</model>"
        f"{more}</world></sdf>"
    )


def dae_text(unit: float = 0.01, up: str = "Z_UP", *, head: str = "") -> str:
    """As COLLADA, in the unit; y up if so said; one geometry, quadrilaterals of triangles."""
    mesh = one_mesh()
    at = np.asarray(mesh.vertices) / unit
    if up == "Y_UP":
        at = np.stack([at[:, 0], at[:, 2], -at[:, 1]], axis=1)
    places = " ".join(f"{value:.6g}" for value in at.ravel())
    corners = " ".join(map(str, mesh.faces.ravel()))
    return f"""<?xml version="1.0"?>{head}
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit meter="{unit}" name="u"/><up_axis>{up}</up_axis></asset>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="pa" count="{at.size}">{places}</float_array>
<technique_common><accessor source="#pa" count="{len(at)}" stride="3"/></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="{len(mesh.faces)}"><input semantic="VERTEX" source="#v" offset="0"/>
<p>{corners}</p></triangles></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node name="building">
<instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>"""


_MODEL = """mtllib chair.mtl
usemtl seat
v 0 0 0
v 1 0 0
v 1 0 1
v 0 0 1
v 0 1 0
v 1 1 0
vt 0 0
vt 1 0
vt 1 1
f 1/1 2/2 3/3 4/1
f 1/1 2/2 6/3 5/1
"""
_MTL = "newmtl seat\nKd 0.5 0.2 0.1\nmap_Kd seat.png\n"


def _png() -> bytes:
    import io

    from PIL import Image

    buffer = io.BytesIO()
    Image.new("RGB", (4, 4), (10, 200, 10)).save(buffer, "PNG")
    return buffer.getvalue()


def write_sh3f(path: Path, entries: Mapping[str, str] | None = None, **files: bytes) -> None:
    """A library of a chair (back at -z, as Sweet Home 3D has it), a bed and a car."""
    lines = ["id=Test#Library", "name=Tiny", "license=CC0", "provider=nobody"]
    for number, (name, category) in enumerate(
        (("Chair", "Office"), ("Bed", "Bedroom"), ("Family car", "Vehicles")), start=1
    ):
        entry = {
            "id": f"Test#{name.lower()}",
            "name": name,
            "category": category,
            "model": "/models/chair.obj",
            "width": "50",
            "depth": "60",
            "height": "90",
            "creator": "A. Maker",
        }
        lines += [f"{key}#{number}={value}" for key, value in {**entry, **(entries or {})}.items()]
        entries = None
    content = {
        "PluginFurnitureCatalog.properties": "\n".join(lines).encode("latin-1"),
        "models/chair.obj": _MODEL.encode(),
        "models/chair.mtl": _MTL.encode(),
        "models/seat.png": _png(),
    }
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in {**content, **files}.items():
            archive.writestr(name, data)


def home_xml(more: str = "", head: str = "") -> str:
    """Two rooms of 4 m by 4 m, drawn in centimetres with y down."""
    walls = [
        (0, 0, 800, 0),
        (800, 0, 800, 400),
        (800, 400, 0, 400),
        (0, 400, 0, 0),
        (400, 0, 400, 400),
    ]
    drawn = "".join(
        f"<wall id='w{n}' xStart='{a}' yStart='{b}' xEnd='{c}' yEnd='{d}' height='250' "
        f"thickness='10' wallAtStart='w' wallAtEnd='w'/>"
        for n, (a, b, c, d) in enumerate(walls)
    )
    return (
        f"<?xml version='1.0'?>{head}<home version='7000' wallHeight='250'>{drawn}"
        "<room name='Kitchen'><point x='0' y='0'/><point x='400' y='0'/>"
        "<point x='400' y='400'/><point x='0' y='400'/></room>"
        "<room name='Bedroom'><point x='400' y='0'/><point x='800' y='0'/>"
        "<point x='800' y='400'/><point x='400' y='400'/></room>"
        "<doorOrWindow name='Door' x='400' y='200' width='90' depth='10' height='208' "
        "angle='1.5707964'/>"
        "<doorOrWindow name='Window' x='200' y='0' width='120' depth='10' height='100' "
        "elevation='90' angle='0'/>"
        "<pieceOfFurniture name='Chair' x='100' y='300' width='50' depth='60' height='90' "
        "angle='0' model='0/chair.obj' creator='A. Maker' license='CC0'/>"
        f"{more}</home>"
    )


def write_sh3d(path: Path, xml: str | None = None, **files: bytes) -> None:
    """A home as an archive, with the model of its chair."""
    content = {
        "Home.xml": (home_xml() if xml is None else xml).encode(),
        "0/chair.obj": _MODEL.encode(),
        "0/chair.mtl": _MTL.encode(),
        "0/seat.png": _png(),
    }
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in {**content, **files}.items():
            archive.writestr(name, data)


def glb_with_accessor(count: int) -> bytes:
    """A GLB that promises so many vertices and holds none."""
    document = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"componentType": 5126, "count": count, "type": "VEC3"}],
    }
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sIII4s", b"glTF", 2, 20 + len(text), len(text), b"JSON")
    return head + text
