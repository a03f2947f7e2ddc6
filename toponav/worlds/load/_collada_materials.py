"""Colours and textures of a COLLADA document."""

from xml.etree.ElementTree import Element

import numpy as np

from toponav.worlds.load._collada_faces import numbers_of
from toponav.worlds.load.mesh_parts import Notes
from toponav.worlds.load.source_files import SourceFiles
from toponav.worlds.load.textures import named_texture
from toponav.worlds.materials import GREY, Material, linear_rgb

__all__ = ["ColladaMaterials"]


class ColladaMaterials:
    """Finds the material behind each symbol of a geometry."""

    def __init__(
        self, root: Element, files: SourceFiles, name: str, notes: Notes, max_texture_px: int
    ) -> None:
        self._files, self._name, self._notes = files, name, notes
        self._max_texture_px = max_texture_px
        self._materials, self._effects, self._images = (
            {
                element.get("id", ""): element
                for element in root.iterfind(f"library_{kind}/{kind[:-1]}")
            }
            for kind in ("materials", "effects", "images")
        )
        self._made: dict[str, Material] = {}
        self._textures: dict[str, np.ndarray | None] = {}

    def of(self, symbol: str, bound: Element | None) -> Material:
        """The material that an instance binds to a symbol, or grey."""
        target = symbol
        if bound is not None:
            for entry in bound.iterfind("bind_material/technique_common/instance_material"):
                if entry.get("symbol") == symbol:
                    target = (entry.get("target") or "").lstrip("#")
        if target not in self._made:
            element = self._materials.get(target)
            self._made[target] = GREY if element is None else self._make(element, target)
        return self._made[target]

    def _make(self, element: Element, identity: str) -> Material:
        instance = element.find("instance_effect")
        url = (instance.get("url") or "").lstrip("#") if instance is not None else ""
        effect = self._effects.get(url)
        label = element.get("name") or identity
        name = "".join(letter for letter in label if letter.isprintable())[:100] or "material"
        profile = effect.find("profile_COMMON") if effect is not None else None
        technique = profile.find("technique") if profile is not None else None
        if profile is None or technique is None or not len(technique):
            return Material(name)
        shading = next((one for one in technique if one.find("diffuse") is not None), None)
        diffuse = shading.find("diffuse") if shading is not None else None
        if shading is None or diffuse is None:
            return Material(name)
        glow = _color(shading.find("emission/color"), 0.0)
        emission = min(max(glow), 1.0)
        picture = diffuse.find("texture")
        if picture is not None:
            texture = self._texture(picture.get("texture") or "", profile)
            if texture is not None:
                return Material(name, (1.0, 1.0, 1.0), texture, emission)
        return Material(name, linear_rgb(_color(diffuse.find("color"), 0.6)), None, emission)

    def _texture(self, reference: str, profile: Element) -> np.ndarray | None:
        """The picture behind a sampler, a surface, or an image's own id."""
        parameters = {
            entry.get("sid", ""): entry
            for holder in (profile, profile.find("technique"))
            if holder is not None
            for entry in holder.iterfind("newparam")
        }
        for _ in range(3):
            entry = parameters.get(reference)
            if entry is None:
                break
            inner = entry.find("sampler2D/source")
            if inner is None:
                inner = entry.find("surface/init_from")
            instance = entry.find("sampler2D/instance_image")
            if instance is not None:
                reference = (instance.get("url") or "").lstrip("#")
            elif inner is not None:
                reference = (inner.text or "").strip()
            else:
                break
        image = self._images.get(reference)
        file = image.findtext("init_from") if image is not None else None
        if image is not None and not (file or "").strip():
            file = image.findtext("init_from/ref")
        if file is None or not file.strip():
            return None
        return self._picture(file.strip())

    def _picture(self, reference: str) -> np.ndarray | None:
        if reference not in self._textures:
            self._textures[reference] = named_texture(
                self._files, self._name, reference, self._notes, max_px=self._max_texture_px
            )
        return self._textures[reference]


def _color(element: Element | None, default: float) -> tuple[float, float, float]:
    values = numbers_of(element.text or "") if element is not None else np.zeros(0)
    if len(values) < 3 or not np.isfinite(values[:3]).all():
        return (default,) * 3
    red, green, blue = np.clip(values[:3], 0.0, 1.0).tolist()
    return (red, green, blue)
