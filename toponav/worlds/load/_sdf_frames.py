"""Poses in SDF documents."""

from xml.etree.ElementTree import Element

import numpy as np
from jaxtyping import Float

from toponav.core.errors import InputError, shown
from toponav.worlds.load.mesh_parts import Notes

__all__ = ["Frame", "frames_of", "numbers_in", "pose_of"]

Frame = Float[np.ndarray, "4 4"]

_MOST_M = 1e6


def numbers_in(element: Element | None, count: int, where: str) -> Float[np.ndarray, " count"]:
    """So many finite numbers in an element's text.

    Raises:
        InputError: It holds others.
    """
    text = (element.text or "") if element is not None else ""
    tag = element.tag if element is not None else "value"
    try:
        values = np.array([float(word) for word in text.split()[: count + 1]])
    except ValueError:
        values = np.zeros(0)
    if len(values) != count or not (np.abs(values) <= _MOST_M).all():
        raise InputError(
            f"<{tag}> must be {count} numbers, got {shown(text.strip(), 60)}",
            where=where,
            remedy="repair the SDF",
        )
    return values


def pose_of(element: Element | None, where: str) -> Frame:
    """The frame of a `<pose>`; none is the identity.

    Raises:
        InputError: It holds anything but six numbers.
    """
    frame = np.eye(4)
    if element is None or not (element.text or "").strip():
        return frame
    if element.get("rotation_format") == "quat_xyzw":
        values = numbers_in(element, 7, where)
        frame[:3, :3] = _from_quaternion(values[3:])
    else:
        values = numbers_in(element, 6, where)
        angles = values[3:]
        if (element.get("degrees") or "").lower() in ("true", "1"):
            angles = np.radians(angles)
        frame[:3, :3] = _from_roll_pitch_yaw(angles)
    frame[:3, 3] = values[:3]
    return frame


def frames_of(model: Element, where: str, notes: Notes) -> dict[str, Frame]:
    """The frame of each link of a model, in the model's frame; `relative_to` is followed."""
    elements: dict[str, Element] = {}
    for element in model:
        if element.tag in ("link", "frame", "joint"):
            elements.setdefault(element.get("name") or "", element)
    found: dict[str, Frame] = {}

    def resolve(name: str, before: tuple[str, ...]) -> Frame:
        if name in found:
            return found[name]
        element = elements[name]
        pose = element.find("pose")
        own = pose_of(pose, where)
        base = (pose.get("relative_to") or pose.get("frame") or "") if pose is not None else ""
        if element.tag == "joint" and not base:
            base = (element.findtext("child") or "").strip()
        if element.tag == "frame" and not base:
            base = element.get("attached_to") or ""
        if base in before or base == name or len(before) > 100:
            raise InputError(
                f"poses refer to one another in a circle: {' > '.join((*before, name))[:150]}",
                where=where,
                remedy="remove one relative_to",
            )
        if base and base != "__model__":
            if base in elements:
                own = resolve(base, (*before, name)) @ own
            else:
                notes.add(f"no frame {shown(base, 40)}: the model's own instead")
        found[name] = own
        return own

    for name in elements:
        resolve(name, ())
    return found


def _from_roll_pitch_yaw(angles: Float[np.ndarray, " 3"]) -> Float[np.ndarray, "3 3"]:
    """Rotation about fixed x, then y, then z."""
    (sr, sp, sy), (cr, cp, cy) = np.sin(angles), np.cos(angles)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def _from_quaternion(xyzw: Float[np.ndarray, " 4"]) -> Float[np.ndarray, "3 3"]:
    length = float(np.linalg.norm(xyzw))
    if length < 1e-9:
        return np.eye(3)
    x, y, z, w = xyzw / length
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
