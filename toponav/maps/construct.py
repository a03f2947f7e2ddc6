"""Topological maps made by machine: from a generator's layout, or from any building."""

from toponav.maps.construct_layout import map_from_layout
from toponav.maps.construct_scene import map_by_measuring
from toponav.maps.spec import TopologicalMap
from toponav.worlds.layout import HallwayLayout
from toponav.worlds.scene import Scene

__all__ = ["map_from_layout", "map_from_scene"]


def map_from_scene(scene: Scene, *, use_layout: bool = True) -> TopologicalMap:
    """The topological map of a building, under the paper's six rules.

    A generated office knows its own hallways and gives its map from them; any other building
    is measured: its rooms, the openings between them, and the lines down its hallways.

    Args:
        scene: The building.
        use_layout: Whether to use a generator's layout where there is one.

    Raises:
        InputError: When no opening leads from one room to another.

    Example:
        >>> from toponav.worlds.load.stanford import load_area
        >>> built = map_from_scene(load_area("graphnav_areas/area_3.yaml"))
        >>> built.node("WC_2").kind.value
        'room'

    Reference:
        Chen et al., A Behavioral Approach to Visual Navigation with Graph Localization
        Networks, RSS 2019, section IV.
    """
    if use_layout and isinstance(scene.layout, HallwayLayout):
        return map_from_layout(scene)
    return map_by_measuring(scene)
