"""Floor plans as ROS `map_server` keeps them: an image and a yaml beside it."""

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from jaxtyping import Bool
from PIL import Image

from toponav.core.errors import InputError, shown
from toponav.core.files import file_beside, read_bytes
from toponav.worlds.grid import GridFrame

__all__ = ["RosMap", "read_ros_map", "read_yaml_mapping"]

_MAX_YAML_BYTES = 64_000
_MAX_YAML_DEPTH = 20
_MAX_PIXELS = 64_000_000
_LARGEST = 1e12
_FORMATS = ("PNG", "PPM", "BMP", "JPEG", "GIF")
"""Pillow reads many more, some with the help of other programs."""


@dataclass(frozen=True, eq=False)
class RosMap:
    """A floor plan and the yaml it came with.

    Attributes:
        path: The yaml file.
        settings: Everything that the yaml says.
        grid: Where the cells lie.
        occupied: Cells that are not known to be free; row 0 is the image's lowest row.
    """

    path: Path
    settings: dict[str, Any]
    grid: GridFrame
    occupied: Bool[np.ndarray, "rows cols"]


def read_yaml_mapping(path: Path) -> dict[str, Any]:
    """The mapping in a yaml file.

    Raises:
        InputError: When the file cannot be read or holds anything but a mapping.
    """
    try:
        text = read_bytes(path, max_bytes=_MAX_YAML_BYTES).decode("utf-8")
        _refuse_unfolding(text, path)
        loaded = yaml.safe_load(text)
    except InputError:
        raise
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line = f" line {mark.line + 1}" if mark else ""
        raise InputError(
            f"is not yaml ({error.problem or error.context})",
            where=f"{path}{line}",
            remedy="repair the line or copy the file again",
        ) from None
    except (yaml.YAMLError, ValueError, LookupError, TypeError, AttributeError):
        # PyYAML's own constructors trip over values such as the date 2001-99-99.
        raise InputError(
            "is not yaml text", where=str(path), remedy="give the yaml file of the map"
        ) from None
    if not isinstance(loaded, dict):
        raise InputError(
            f"must hold a mapping, got {type(loaded).__name__}",
            where=str(path),
            remedy="give the yaml file of a map (image, resolution, origin, ...)",
        )
    return {str(key): value for key, value in loaded.items()}


def _refuse_unfolding(text: str, path: Path) -> None:
    """A map needs neither aliases, which unfold into billions of values, nor deep nesting."""
    depth = 0
    for event in yaml.parse(text, Loader=yaml.SafeLoader):
        depth += isinstance(event, yaml.CollectionStartEvent)
        depth -= isinstance(event, yaml.CollectionEndEvent)
        what = f"aliases such as *{event.anchor}" if isinstance(event, yaml.AliasEvent) else ""
        if depth > _MAX_YAML_DEPTH:
            what = f"more than {_MAX_YAML_DEPTH} levels of lists and mappings"
        if what:
            line = f" line {event.start_mark.line + 1}" if event.start_mark else ""
            raise InputError(
                f"{what} are not read", where=f"{path}{line}", remedy="write the values out"
            )


def read_ros_map(yaml_path: str | Path) -> RosMap:
    """The floor plan that a map's yaml describes.

    Pixels darker than `occupied_thresh` are solid, lighter than `free_thresh` are free, and
    what lies between counts as solid because nobody saw it free.

    Raises:
        InputError: When the yaml or the image is broken; the message names the file.

    Reference:
        https://wiki.ros.org/map_server#YAML_format
    """
    path = Path(yaml_path)
    settings = read_yaml_mapping(path)
    resolution_m = _number(settings, "resolution", path)
    free_below = _free_threshold(settings, path)
    origin = settings.get("origin")
    if not isinstance(origin, list) or len(origin) not in (2, 3):
        raise InputError(
            f"origin must be [x, y, yaw], got {shown(origin)}",
            where=str(path),
            remedy="give the lower-left corner in metres",
        )
    corner = {f"origin[{place}]": value for place, value in enumerate(origin)}
    x_m, y_m = (_number(corner, f"origin[{axis}]", path) for axis in (0, 1))
    if len(origin) == 3 and abs(_number(corner, "origin[2]", path)) > 1e-9:
        raise InputError(
            f"a turned map is not supported, got yaw {origin[2]}",
            where=str(path),
            remedy="turn the image and set the yaw of origin to 0",
        )
    shade = _read_shades(file_beside(path, settings.get("image"), "image"))
    _check_size(settings, shade.shape, path)
    darkness = _darkness(shade, settings, path)
    try:
        grid = GridFrame(resolution_m, (x_m, y_m), *darkness.shape)
    except InputError as error:
        raise InputError(error.rule, where=str(path), remedy=error.remedy) from None
    occupied = np.ascontiguousarray(darkness[::-1] >= free_below)
    return RosMap(path, settings, grid, occupied)


def _free_threshold(settings: dict[str, Any], path: Path) -> float:
    """The occupancy below which a cell is free; both thresholds have to make sense."""
    free = _number(settings, "free_thresh", path, default=0.196)
    solid = _number(settings, "occupied_thresh", path, default=max(0.65, free))
    if not 0.0 < free <= solid <= 1.0:
        raise InputError(
            f"0 < free_thresh <= occupied_thresh <= 1 must hold, got {free:g} and {solid:g}",
            where=str(path),
            remedy="set free_thresh: 0.196 and occupied_thresh: 0.65, map_server's own",
        )
    return free


def _check_size(settings: dict[str, Any], shape: tuple[int, ...], path: Path) -> None:
    """That an image is as large as the yaml says, where it says so."""
    for key, pixels in (("height", shape[0]), ("width", shape[1])):
        if settings.get(key) is not None and settings[key] != pixels:
            raise InputError(
                f"{key} says {shown(settings[key])}, but the image has {pixels} pixels",
                where=str(path),
                remedy="check that the yaml and the image belong together",
            )


def _darkness(shade: np.ndarray, settings: dict[str, Any], path: Path) -> np.ndarray:
    """How sure each pixel is solid, from 0 to 1, in the yaml's mode."""
    negate, mode = settings.get("negate", 0), settings.get("mode", "trinary")
    if negate not in (0, 1):
        raise InputError(
            f"negate must be 0 or 1, got {shown(negate)}", where=str(path), remedy="set negate: 0"
        )
    if mode not in ("trinary", "scale", "raw"):
        raise InputError(
            f"mode must be trinary, scale or raw, got {shown(mode)}",
            where=str(path),
            remedy="set mode: trinary",
        )
    if mode == "raw":  # The pixel is the occupancy in percent; more than 100 is unknown.
        percent: np.ndarray = shade * 2.55
        return percent
    return shade if negate else 1.0 - shade


def _read_shades(path: Path) -> np.ndarray:
    """The image as grey values from 0 (black) to 1 (white)."""
    try:
        if path.exists() and not path.is_file():
            raise ValueError("it is no file")
        # Too many pixels for comfort is a warning in Pillow and an error here.
        with warnings.catch_warnings():
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            with Image.open(path, formats=_FORMATS) as image:
                if image.width * image.height > _MAX_PIXELS:
                    raise Image.DecompressionBombError(f"{image.width} x {image.height} pixels")
                if image.mode == "F":
                    raise ValueError("its pixels are no integers")
                if image.mode.startswith("I"):  # 16 bits a pixel; convert("L") would clip them
                    return np.asarray(image, dtype=np.float32) / 65535.0
                return np.asarray(image.convert("L"), dtype=np.float32) / 255.0
    except FileNotFoundError:
        raise InputError(
            "no such image", where=str(path), remedy="put it beside the yaml that names it"
        ) from None
    except (Image.DecompressionBombError, Image.DecompressionBombWarning) as error:
        raise InputError(
            f"a floor plan has at most {_MAX_PIXELS:,} pixels ({error})",
            where=str(path),
            remedy="cut it into parts or use a coarser resolution",
        ) from None
    except Exception as error:  # Image decoders fail in many ways on damaged files.
        raise InputError(
            f"is not a whole PNG, PGM, BMP, JPEG or GIF image ({str(error)[:200]})",
            where=str(path),
            remedy="copy the image again",
        ) from None


def _number(settings: dict[str, Any], key: str, path: Path, default: float | None = None) -> float:
    """A finite number from the yaml."""
    value = settings.get(key, default)
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= _LARGEST:
        raise InputError(
            f"{key} must be a number, got {shown(value)}", where=str(path), remedy=f"set {key}"
        )
    return float(value)
