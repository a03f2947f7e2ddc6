import io
import struct
import zlib

import numpy as np
import pytest
from scipy.io import loadmat, savemat

from toponav.worlds.load.matlab import MatlabStruct, read_matlab_variable


def saved(value, *, packed=False, name="area_data"):
    buffer = io.BytesIO()
    savemat(buffer, {"other": 1, name: value}, do_compression=packed)
    return buffer.getvalue()


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize(
    "value",
    [
        np.arange(12, dtype=np.uint8).reshape(3, 4),
        np.linspace(0, 1, 24).reshape(2, 3, 4),
        np.array([[-1, 2]], np.int32),
        np.float32([[1.5]]),
        np.zeros((0, 0)),
    ],
)
def test_numbers_come_back_as_scipy_reads_them(value, packed):
    content = saved(value, packed=packed)
    found = read_matlab_variable(content, "area_data")
    expected = loadmat(io.BytesIO(content))["area_data"]
    np.testing.assert_array_equal(found, expected)
    assert found.dtype.kind == expected.dtype.kind


def test_structs_hold_text_numbers_and_lists_by_field():
    rooms = np.zeros(2, [("name", object), ("id", object), ("tags", object)])
    rooms[:] = [("lobby_1", 4, np.array(["a", 2], object)), ("büro_2", 9, np.zeros(0, object))]
    found = read_matlab_variable(saved({"rooms": rooms, "size": 5.0}), "area_data")
    assert isinstance(found, MatlabStruct)
    assert found.count == 1
    (inner,) = found.values("rooms")
    assert inner.count == 2
    assert inner.values("name") == ["lobby_1", "büro_2"]
    assert [int(number.item()) for number in inner.values("id")] == [4, 9]
    assert inner.values("tags")[0][0] == "a"
    assert inner.values("none") == [None, None]


def test_the_areas_come_back_as_scipy_reads_them(areas_dir):
    path = areas_dir / "area_3.mat"
    found = read_matlab_variable(path.read_bytes(), "area_data")
    expected = loadmat(path, struct_as_record=False, squeeze_me=True)["area_data"]
    np.testing.assert_array_equal(found.values("semantic_map")[0], expected.semantic_map)
    (rooms,) = found.values("rooms")
    assert rooms.values("name") == [room.name for room in expected.rooms]
    np.testing.assert_array_equal(rooms.values("points")[7], expected.rooms[7].points)


def test_complex_and_missing_values_are_none():
    assert read_matlab_variable(saved(np.array([[1j]])), "area_data") is None
    assert read_matlab_variable(saved(1.0), "nothing") is None


def element(kind, data):
    return struct.pack("<2I", kind, len(data)) + data + bytes(-len(data) % 8)


def matrix(array_class, sizes, *parts):
    head = element(6, struct.pack("<2I", array_class, 0))
    head += element(5, struct.pack(f"<{len(sizes)}i", *sizes)) + element(1, b"x")
    return element(14, head + b"".join(parts))


HEADER = bytes(124) + b"\x00\x01IM"


@pytest.mark.parametrize(
    ("body", "message"),
    [
        (struct.pack("<2I", 14, 10**9), "an element of 1,000,000,000 bytes where 0 are left"),
        (matrix(6, (2**30, 2**30)), "numbers of type 0|bytes for a matrix"),
        (matrix(6, (2, 2), element(9, bytes(8))), r"8 bytes for a matrix of size \(2, 2\)"),
        (matrix(6, (-1, 2), element(9, bytes(8))), r"a matrix of size \(-1, 2\)"),
        (matrix(2, (1, 1), element(5, bytes(4))), "a struct without names"),
        (matrix(1, (2**30, 2)), "parts"),
        (matrix(4, (1, 1), element(99, b"a")), "text of type 99"),
        (struct.pack("<2I", 15, 4) + b"abcd", "packed data is damaged"),
        (struct.pack("<2I", 15, 8) + zlib.compress(bytes(99))[:8], "packed data is cut"),
    ],
)
def test_what_cannot_be_is_refused(body, message):
    with pytest.raises(ValueError, match=message):
        read_matlab_variable(HEADER + body, "x")


def test_endless_nesting_is_refused():
    body = matrix(1, (1, 1))
    for _ in range(40):
        body = matrix(1, (1, 1), body)
    with pytest.raises(ValueError, match="nested too deep"):
        read_matlab_variable(HEADER + body, "x")
