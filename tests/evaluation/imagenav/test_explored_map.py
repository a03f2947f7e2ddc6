"""Rooms and doors out of what a robot saw, and driving on the map that they make."""

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.evaluation.imagenav.searches import START, building, simulation
from toponav.core.errors import InputError
from toponav.core.geometry import Pose2
from toponav.core.imagenav import ImageNavBelief
from toponav.core.vocabulary import NodeKind
from toponav.evaluation.imagenav.drive_explored import drive_explored
from toponav.evaluation.imagenav.explore import Explored
from toponav.evaluation.imagenav.explored_map import map_of_floor, seen_floor, with_rooms_of
from toponav.maps.image_graph import ImageGraph
from toponav.maps.spec import MapFrame, TopologicalMap
from toponav.maps.validate import validate
from toponav.navigation.nts.local_map import LocalMap

_TURNED = Pose2(START.x_m, START.y_m, 0.7)


def _seen(start: Pose2) -> LocalMap:
    """The occupancy of both rooms, in the frame of a turned start."""
    robot, seen = simulation(), LocalMap()
    for x_m in np.arange(0.6, 9.5, 0.8):
        for y_m in (1.0, 3.0, 5.0):
            if abs(x_m - 5.0) < 0.5 and y_m != 3.0:
                continue
            pose = Pose2(float(x_m), y_m, 0.3)
            depth_m = robot.see(pose)[1]
            assert depth_m is not None
            seen.add_depth(depth_m, pose.relative_to(start))
    return seen


def _explored() -> Explored:
    floor = seen_floor(_seen(_TURNED), _TURNED, "two-rooms")
    drawn, roomed = map_of_floor(floor)
    return Explored(ImageGraph(), drawn, roomed, (), _TURNED, ImageNavBelief(), 1.0, 0.0, 0, "")


def test_seen_floor_lies_where_the_building_is() -> None:
    floor = seen_floor(_seen(_TURNED), _TURNED, "two-rooms")
    rows, cols = np.mgrid[: building().grid.rows, : building().grid.cols]
    same = 0
    for row, col in zip(rows.ravel().tolist(), cols.ravel().tolist(), strict=True):
        at = floor.grid.cell_of(*building().grid.center_of(row, col))
        inside = 0 <= at[0] < floor.grid.rows and 0 <= at[1] < floor.grid.cols
        same += (not inside or bool(floor.occupied[at])) == bool(building().occupied[row, col])
    assert same / rows.size > 0.97


def test_map_has_both_rooms_and_the_doorway() -> None:
    found = _explored()
    kinds = [node.kind for node in found.map.nodes]
    assert kinds.count(NodeKind.ROOM) == 2
    doors = [node for node in found.map.nodes if node.kind is NodeKind.DOOR]
    assert doors
    assert all(math.dist((node.x_m, node.y_m), (5.0, 3.0)) < 0.6 for node in doors)
    assert not [fault for fault in validate(found.map) if fault.severity == "error"]


def test_the_expert_drives_on_the_map_in_the_building() -> None:
    records = drive_explored(building(), _explored(), 2, agents=("expert",))
    assert [record.agent for record in records] == ["expert", "expert"]
    assert all(record.tolerant.success for record in records)


def test_rooms_of_the_plan_are_laid_over_the_building() -> None:
    found = _explored()
    named = with_rooms_of(building(), found.floor)
    assert named.room_at(2.0, 3.0) != named.room_at(8.0, 3.0)
    assert {named.room_at(2.0, 3.0), named.room_at(8.0, 3.0)} == set(found.map.rooms)
    assert (named.heights_m == building().heights_m).all()


def test_a_map_without_rooms_cannot_be_driven_on() -> None:
    empty = TopologicalMap("none", MapFrame(), (), ())
    found = replace(_explored(), map=empty, why_no_rooms="the floor is one piece")
    with pytest.raises(InputError, match="one piece"):
        drive_explored(building(), found, 1)


def test_floor_that_was_not_seen_gives_no_plan() -> None:
    with pytest.raises(InputError, match="saw no floor"):
        seen_floor(LocalMap(), START, "dark")
