"""Where the models and meshes lie that an SDF document names."""

import os
import posixpath
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element

from toponav.core.errors import InputError, shown
from toponav.core.files import os_fault, read_bytes
from toponav.core.xml_tree import parse_xml
from toponav.worlds.load.mesh_parts import Notes
from toponav.worlds.load.source_files import FolderFiles

__all__ = ["ModelFolders"]

_MAX_CONFIG_BYTES = 1_000_000
_SCHEMES = ("model://", "package://")


@dataclass(frozen=True)
class ModelFolders:
    """Folders that hold models; nothing outside them and the world's own folder is read."""

    folders: tuple[Path, ...]

    @staticmethod
    def beside(world: Path, given: Sequence[Path]) -> "ModelFolders":
        """The given folders, then those beside the world where Gazebo users keep models.

        Raises:
            InputError: A given folder is none.
        """
        for folder in given:
            if not folder.is_dir():
                raise InputError(
                    "no such folder", where=f"--models {folder}", remedy="check the path"
                )
        home = world.parent
        usual = [home / "models", home.parent / "models", home, home.parent]
        return ModelFolders((*given, *(folder for folder in usual if folder.is_dir())))

    def model_file(self, uri: str, document: Path, notes: Notes) -> Path | None:
        """The SDF file that an include names; None, noted, where it is on the network.

        Raises:
            InputError: There is none.
        """
        if "://" in uri and not uri.startswith((*_SCHEMES, "file://")):
            notes.add(f"include {shown(uri, 80)} left out: nothing is fetched from the network")
            return None
        where = str(document)
        files, name = self.locate(uri, document)
        place = files.root / name if name else files.root
        try:
            if place.is_dir():
                place = _sdf_in(place)
            file = place.resolve()
            if not file.is_relative_to(files.root.resolve()) or not file.is_file():
                raise InputError(
                    f"no model {shown(uri, 80)}", where=where, remedy="give its folder by --models"
                )
        except OSError as error:
            raise os_fault(error, place) from None
        return file

    def locate(self, uri: str, document: Path) -> tuple[FolderFiles, str]:
        """The folder that a URI may read from, and the name of the file in it.

        Raises:
            InputError: No model of that name lies in the folders, or the URI leads out of them.
        """
        scheme = next((one for one in _SCHEMES if uri.startswith(one)), None)
        rest = uri[len(scheme) :] if scheme else uri.removeprefix("file://")
        plain = posixpath.normpath(rest.replace("\\", "/")) if rest else ""
        if (
            not plain
            or plain.startswith(("/", "../"))
            or plain in (".", "..")
            or len(plain) > 500
            or not plain.isprintable()
        ):
            raise InputError(
                f"a model must lie in the given folders, got {shown(uri, 80)}",
                where=str(document),
                remedy="copy it there and name it as model://NAME",
            )
        model, _, name = plain.partition("/")
        if scheme is None:
            return FolderFiles(_model_root(document.parent, self.folders)), _below(
                document.parent, _model_root(document.parent, self.folders), plain
            )
        for folder in self.folders:
            if os.path.isdir(folder / model):
                return FolderFiles(folder / model), name
        looked = ", ".join(str(folder) for folder in self.folders)
        raise InputError(
            f"no model {shown(model, 80)} in {looked[:300]}",
            where=str(document),
            remedy="give the folder that holds it by --models",
        )


def _model_root(folder: Path, folders: Sequence[Path]) -> Path:
    """The model's own folder: meshes lie below it, and so may their textures."""
    for root in folders:
        try:
            inside = folder.resolve().relative_to(root.resolve())
        except (ValueError, OSError):
            continue
        if inside.parts:
            return root / inside.parts[0]
    return folder


def _below(folder: Path, root: Path, name: str) -> str:
    """A name relative to a folder as one relative to its root."""
    try:
        before = folder.resolve().relative_to(root.resolve())
    except (ValueError, OSError):
        return name
    return posixpath.normpath(posixpath.join(before.as_posix(), name))


def _sdf_in(folder: Path) -> Path:
    """The SDF file of a model's folder, as its `model.config` says."""
    config = folder / "model.config"
    if config.is_file():
        root = parse_xml(read_bytes(config, max_bytes=_MAX_CONFIG_BYTES), str(config))
        found = sorted(root.iterfind("sdf"), key=_version)
        name = (found[-1].text or "").strip() if found else ""
        if name and not name.startswith("/") and ".." not in name.split("/"):
            return folder / name
    return folder / "model.sdf"


def _version(element: Element) -> tuple[int, ...]:
    parts = (element.get("version") or "0").split(".")
    return tuple(int(part) if part.isdigit() and len(part) < 6 else 0 for part in parts[:4])
