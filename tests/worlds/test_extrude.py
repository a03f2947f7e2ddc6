import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from toponav.worlds.extrude import extrude, instances_of, merge_rectangles
from toponav.worlds.grid import GridFrame, SemanticClass
from toponav.worlds.scene import scene_from_heights

CEILING_M = 2.5

masks = arrays(bool, st.tuples(st.integers(1, 12), st.integers(1, 12)))
height_rasters = arrays(
    np.float32,
    st.tuples(st.integers(1, 7), st.integers(1, 7)),
    elements=st.sampled_from([0.0, 0.7, 1.5, CEILING_M]),
)


def mesh_of(heights, cell_m=1.0):
    grid = GridFrame(cell_m, (0.0, 0.0), *heights.shape)
    return scene_from_heights("s", grid, heights, ceiling_m=CEILING_M).mesh


def areas_and_normals(mesh):
    a, b, c = (mesh.vertices_m[mesh.faces[:, i]].astype(float) for i in range(3))
    cross = np.cross(b - a, c - a)
    length = np.linalg.norm(cross, axis=1)
    return length / 2, cross / length[:, None]


@given(masks)
@settings(max_examples=50, deadline=None)
def test_rectangles_cover_the_mask_exactly_once(mask):
    count = np.zeros(mask.shape, int)
    for row0, col0, row1, col1 in merge_rectangles(mask):
        assert row0 < row1
        assert col0 < col1
        count[row0:row1, col0:col1] += 1
    assert np.array_equal(count, mask)


def test_rectangles_of_simple_shapes_are_few():
    assert len(merge_rectangles(np.ones((50, 70), bool))) == 1
    ring = np.ones((40, 40), bool)
    ring[1:-1, 1:-1] = False
    assert len(merge_rectangles(ring)) == 4
    assert len(merge_rectangles(np.zeros((3, 3), bool))) == 0


def test_many_rectangles_outgrow_the_first_buffer():
    checker = np.indices((40, 40)).sum(axis=0) % 2 == 0
    assert len(merge_rectangles(checker)) == 800


def test_instances_number_connected_pieces_of_one_class():
    wall, chair = SemanticClass.WALL, SemanticClass.CHAIR
    semantics = np.array([[wall, 0, chair], [wall, 0, 0], [chair, 0, wall]], np.uint8)
    instances = instances_of(semantics)
    assert instances[0, 0] == instances[1, 0]
    assert len(np.unique(instances)) == 5
    assert instances[0, 1] == -1


def test_empty_room_is_a_box_of_twelve_triangles_that_faces_inwards():
    mesh = mesh_of(np.zeros((4, 6)))
    assert len(mesh.faces) == 12
    assert len(mesh.vertices_m) == 8
    _, normals = areas_and_normals(mesh)
    center = np.array([3.0, 2.0, CEILING_M / 2])
    inwards = center - mesh.vertices_m[mesh.faces[:, 0]]
    assert ((normals * inwards).sum(axis=1) > 0).all()


def test_box_on_the_floor_has_a_top_and_four_outward_sides():
    heights = np.zeros((5, 5))
    heights[2, 1:4] = 0.7
    mesh = mesh_of(heights)
    box = mesh.face_semantic == SemanticClass.FURNITURE
    areas, normals = areas_and_normals(mesh)
    assert box.sum() == 10
    up = box & (normals[:, 2] > 0.5)
    assert areas[up].sum() == pytest.approx(3.0)
    assert areas[box & ~up].sum() == pytest.approx(0.7 * 8)
    outwards = mesh.vertices_m[mesh.faces].mean(axis=1) - np.array([2.5, 2.5, 0.35])
    assert ((normals * outwards)[box & ~up][:, :2].sum(axis=1) > 0).all()


@given(height_rasters)
@settings(max_examples=40, deadline=None)
def test_side_and_top_areas_equal_those_summed_cell_by_cell(heights):
    mesh = mesh_of(heights)
    areas, normals = areas_and_normals(mesh)
    padded = np.pad(heights, 1, constant_values=CEILING_M)
    sides = np.abs(np.diff(padded, axis=0))[:, 1:-1].sum()
    sides += np.abs(np.diff(padded, axis=1))[1:-1].sum()
    flat = np.abs(normals[:, 2]) > 0.5
    assert areas[~flat].sum() == pytest.approx(sides, rel=1e-5, abs=1e-6)
    middle_m = mesh.vertices_m[mesh.faces][:, :, 2].mean(axis=1)
    tops = flat & (middle_m > 0) & (middle_m < CEILING_M)
    low = (heights > 0) & (heights < CEILING_M)
    assert areas[tops].sum() == pytest.approx(low.sum(), abs=1e-6)
    assert (normals[tops, 2] > 0).all()


@given(height_rasters, st.integers(0, 2**32 - 1))
@settings(max_examples=40, deadline=None)
def test_no_ray_from_free_space_escapes_and_the_first_hit_is_the_grids(heights, seed):
    """Möller-Trumbore over all triangles against walking the raster in tiny steps."""
    free = np.argwhere(heights == 0)
    if not len(free):
        return
    rng = np.random.default_rng(seed)
    mesh = mesh_of(heights)
    row, col = free[rng.integers(len(free))]
    origin = np.array([col + rng.uniform(0.2, 0.8), row + rng.uniform(0.2, 0.8), 0.6])
    direction = rng.normal(size=3) * (1, 1, 0.3)
    direction /= np.linalg.norm(direction)
    hit = first_hit(mesh, origin, direction)
    assert np.isfinite(hit)
    steps = np.arange(0, hit - 0.02, 0.01)
    points = origin + steps[:, None] * direction
    at = heights[points[:, 1].astype(int), points[:, 0].astype(int)]
    assert (points[:, 2] > at - 0.02).all()
    beyond = origin + (hit + 0.01) * direction
    row, col = int(np.floor(beyond[1])), int(np.floor(beyond[0]))
    inside = 0 <= row < heights.shape[0] and 0 <= col < heights.shape[1]
    solid = not inside or beyond[2] <= heights[row, col] + 0.02
    assert solid or beyond[2] < 0.02 or beyond[2] > CEILING_M - 0.02


def first_hit(mesh, origin, direction):
    a, b, c = (mesh.vertices_m[mesh.faces[:, i]].astype(float) for i in range(3))
    normal = np.cross(b - a, c - a)
    facing = normal @ direction
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = ((a - origin) * normal).sum(axis=1) / facing
        point = origin + distance[:, None] * direction
        inside = np.ones(len(a), bool)
        for p, q in ((a, b), (b, c), (c, a)):
            inside &= (np.cross(q - p, point - p) * normal).sum(axis=1) >= -1e-9
    return distance[inside & (distance > 1e-6)].min(initial=np.inf)


def test_neighbours_of_different_height_share_one_step():
    heights = np.zeros((3, 4))
    heights[1, 1], heights[1, 2] = 0.7, 1.5
    areas, normals = areas_and_normals(mesh_of(heights))
    to_the_left = areas[normals[:, 0] < -0.5]
    # Two triangles each: the low box, the step up to the high one, and the outer wall.
    assert sorted(2 * to_the_left) == pytest.approx([0.7, 0.7, 0.8, 0.8] + [3 * CEILING_M] * 2)


def test_straight_walls_stay_small_whatever_the_resolution():
    heights = np.zeros((200, 300))
    heights[50] = CEILING_M
    heights[50, 100:110] = 0
    # Outer box 12, upper and lower faces 8, the two jambs 4; the wall cuts both outer sides.
    assert len(mesh_of(heights, 0.05).faces) == 12 + 8 + 4 + 4


def test_class_of_each_face_is_that_of_the_cell_behind_it():
    grid = GridFrame(1.0, (0.0, 0.0), 3, 3)
    heights, semantics = np.zeros((3, 3), np.float32), np.zeros((3, 3), np.uint8)
    heights[1, 1], semantics[1, 1] = 0.8, SemanticClass.CHAIR
    mesh = extrude(grid, heights, semantics, CEILING_M)
    assert (mesh.face_semantic == SemanticClass.CHAIR).sum() == 10
    assert set(mesh.face_instance[mesh.face_semantic == SemanticClass.CHAIR]) == {0}
    assert set(mesh.face_instance[mesh.face_semantic == SemanticClass.FLOOR]) == {-1}
