"""Compiled loops over the text of Wavefront OBJ files."""

import numpy as np
from numba import njit

__all__ = ["count_obj", "fill_obj"]

# Kinds of lines.
_OTHER, _VERTEX, _TEXTURE, _FACE, _NAME = 0, 1, 2, 3, 4


@njit(cache=True)
def count_obj(data):  # type: ignore[no-untyped-def]
    """How many vertices, texture places, triangles and naming lines the text holds."""
    vertices = places = triangles = names = 0
    at, end = 0, len(data)
    while at < end:
        at = _spaces(data, at, end)
        kind, at = _kind(data, at, end)
        if kind == _VERTEX:
            vertices += 1
        elif kind == _TEXTURE:
            places += 1
        elif kind == _NAME:
            names += 1
        elif kind == _FACE:
            corners = 0
            while True:
                at = _spaces(data, at, end)
                if at >= end or data[at] == 10 or data[at] == 35:
                    break
                corners += 1
                while at < end and not _is_space(data[at]) and data[at] != 10:
                    at += 1
            triangles += max(corners - 2, 0)
        at = _line_end(data, at, end)
    return vertices, places, triangles, names


@njit(cache=True)
def fill_obj(data, vertices, places, corner_vertex, corner_place, name_at, name_face):  # type: ignore[no-untyped-def]
    """Writes what `count_obj` counted; polygons become fans, indices count from zero.

    `corner_place` is -1 where a corner names none. `name_at` is where in the text a naming
    line begins, `name_face` how many triangles came before it.
    """
    vertex = place = triangle = name = 0
    at, end = 0, len(data)
    while at < end:
        at = _spaces(data, at, end)
        begin = at
        kind, at = _kind(data, at, end)
        if kind == _VERTEX:
            for axis in range(3):
                at = _spaces(data, at, end)
                vertices[vertex, axis], at = _number(data, at, end)
            vertex += 1
        elif kind == _TEXTURE:
            for axis in range(2):
                at = _spaces(data, at, end)
                if at < end and data[at] != 10:
                    places[place, axis], at = _number(data, at, end)
            place += 1
        elif kind == _NAME:
            name_at[name] = begin
            name_face[name] = triangle
            name += 1
        elif kind == _FACE:
            corners = 0
            first_v = first_t = last_v = last_t = -1
            while True:
                at = _spaces(data, at, end)
                if at >= end or data[at] == 10 or data[at] == 35:
                    break
                v, at = _index(data, at, end, vertex)
                t = -1
                if at < end and data[at] == 47:  # '/'
                    t, at = _index(data, at + 1, end, place)
                while at < end and not _is_space(data[at]) and data[at] != 10:
                    at += 1
                if corners == 0:
                    first_v, first_t = v, t
                elif corners >= 2:
                    corner_vertex[triangle, 0] = first_v
                    corner_vertex[triangle, 1] = last_v
                    corner_vertex[triangle, 2] = v
                    corner_place[triangle, 0] = first_t
                    corner_place[triangle, 1] = last_t
                    corner_place[triangle, 2] = t
                    triangle += 1
                last_v, last_t = v, t
                corners += 1
        at = _line_end(data, at, end)


@njit(cache=True)
def _is_space(letter):  # type: ignore[no-untyped-def]
    return letter == 32 or letter == 9 or letter == 13


@njit(cache=True)
def _spaces(data, at, end):  # type: ignore[no-untyped-def]
    """Past spaces, and past a backslash that joins two lines."""
    while at < end:
        if _is_space(data[at]):
            at += 1
        elif data[at] == 92 and at + 1 < end and data[at + 1] == 10:
            at += 2
        elif data[at] == 92 and at + 2 < end and data[at + 1] == 13 and data[at + 2] == 10:
            at += 3
        else:
            break
    return at


@njit(cache=True)
def _line_end(data, at, end):  # type: ignore[no-untyped-def]
    while at < end and data[at] != 10:
        at += 1
    return at + 1


@njit(cache=True)
def _kind(data, at, end):  # type: ignore[no-untyped-def]
    """What the line says, and where its first word ends."""
    begin = at
    while at < end and not _is_space(data[at]) and data[at] != 10:
        at += 1
    size = at - begin
    if size == 1:
        if data[begin] == 118:  # v
            return _VERTEX, at
        if data[begin] == 102:  # f
            return _FACE, at
        if data[begin] == 111 or data[begin] == 103:  # o, g
            return _NAME, at
    elif size == 2 and data[begin] == 118 and data[begin + 1] == 116:  # vt
        return _TEXTURE, at
    elif size == 6:  # usemtl, mtllib
        first, second = data[begin], data[begin + 1]
        if (first == 117 and second == 115) or (first == 109 and second == 116):
            return _NAME, at
    return _OTHER, at


@njit(cache=True)
def _index(data, at, end, count):  # type: ignore[no-untyped-def]
    """A corner's index from zero, -1 where there is none; negative ones count backwards."""
    negative = at < end and data[at] == 45
    if negative:
        at += 1
    value = 0
    digits = 0
    while at < end and 48 <= data[at] <= 57 and digits < 10:
        value = 10 * value + (data[at] - 48)
        digits += 1
        at += 1
    if digits == 0 or value == 0 or value > 2000000000:
        return -1, at
    if negative:
        return max(count - value, -1), at
    return value - 1, at


@njit(cache=True)
def _number(data, at, end):  # type: ignore[no-untyped-def]
    """A decimal number, NaN where there is none, and where it ends."""
    begin = at
    sign = 1.0
    if at < end and (data[at] == 45 or data[at] == 43):
        sign = -1.0 if data[at] == 45 else 1.0
        at += 1
    value = 0.0
    digits = 0
    scale = 0
    while at < end and 48 <= data[at] <= 57:
        value = 10.0 * value + (data[at] - 48)
        digits += 1
        at += 1
    if at < end and data[at] == 46:
        at += 1
        while at < end and 48 <= data[at] <= 57:
            value = 10.0 * value + (data[at] - 48)
            digits += 1
            scale -= 1
            at += 1
    good = digits > 0
    if good and at < end and (data[at] == 101 or data[at] == 69):
        at += 1
        minus = at < end and data[at] == 45
        if at < end and (data[at] == 45 or data[at] == 43):
            at += 1
        exponent = 0
        while at < end and 48 <= data[at] <= 57:
            exponent = min(10 * exponent + (data[at] - 48), 1000)
            at += 1
        scale += -exponent if minus else exponent
    if at < end and not _is_space(data[at]) and data[at] != 10:
        good = False
        while at < end and not _is_space(data[at]) and data[at] != 10:
            at += 1
    if not good or at == begin:
        return np.nan, at
    return sign * value * 10.0 ** float(max(min(scale, 300), -300)), at
