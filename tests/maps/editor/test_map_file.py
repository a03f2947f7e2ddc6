"""A map file is never lost: not by a failed write, not by somebody else's, not by ours."""

import os

import pytest

from tests.maps.editor.small_office import EDGES, NODES
from toponav.core.errors import InputError
from toponav.maps.editor.map_file import ChangedOnDiskError, MapFile
from toponav.maps.spec import MapFrame, TopologicalMap, load_map, map_from_document, save_map

OFFICE = TopologicalMap("office", MapFrame(), NODES, EDGES)
ONE_NODE = TopologicalMap("office", MapFrame(), NODES[:1], ())


@pytest.fixture
def path(tmp_path):
    return save_map(OFFICE, tmp_path / "office.topo.json")


def test_file_that_is_not_there_opens_as_an_empty_map(tmp_path):
    file = MapFile(tmp_path / "attic.topo.json")
    opened = file.open()
    assert (opened.version, opened.document["name"]) == ("", "attic")
    assert map_from_document(opened.document).nodes == ()
    assert not file.path.exists()


def test_saved_map_is_what_load_map_reads(path):
    file = MapFile(path)
    version = file.save(ONE_NODE, file.open().version)
    assert load_map(path) == ONE_NODE
    assert version == file.version() == file.open().version


def test_first_save_keeps_what_it_replaces_and_later_saves_do_not_touch_that(path):
    file = MapFile(path)
    version = file.save(ONE_NODE, file.version())
    file.save(TopologicalMap("office", MapFrame(), (), ()), version)
    assert load_map(path.with_name("office.topo.json~")) == OFFICE


def test_file_that_somebody_else_wrote_is_not_overwritten_unseen(path):
    file = MapFile(path)
    base = file.open().version
    save_map(ONE_NODE, path)
    with pytest.raises(ChangedOnDiskError):
        file.save(OFFICE, base)
    assert load_map(path) == ONE_NODE


def test_file_that_somebody_else_removed_counts_as_changed(path):
    file = MapFile(path)
    base = file.open().version
    path.unlink()
    with pytest.raises(ChangedOnDiskError):
        file.save(OFFICE, base)


def test_file_that_somebody_else_created_counts_as_changed(tmp_path):
    file = MapFile(tmp_path / "new.topo.json")
    base = file.open().version
    save_map(OFFICE, file.path)
    with pytest.raises(ChangedOnDiskError):
        file.save(ONE_NODE, base)


def test_overwriting_keeps_what_somebody_else_wrote(path):
    file = MapFile(path)
    base = file.open().version
    for number in (1, 2):
        path.write_text(f"not a map {number}")
        base = file.save(OFFICE, base, overwrite=True)
        assert path.with_name(f"office.overwritten-{number}.topo.json").read_text() == (
            f"not a map {number}"
        )
    assert load_map(path) == OFFICE


def test_copies_never_replace_a_file(path):
    file = MapFile(path)
    names = [file.save_copy(ONE_NODE).name for _ in range(2)]
    assert names == ["office.copy-1.topo.json", "office.copy-2.topo.json"]
    assert load_map(path) == OFFICE


def test_failed_write_keeps_the_previous_save(path, monkeypatch):
    file = MapFile(path)
    base = file.open().version

    def refuse(*args):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", refuse)
    with pytest.raises(InputError, match="No space"):
        file.save(ONE_NODE, base)
    assert load_map(path) == OFFICE
    assert sorted(one.name for one in path.parent.iterdir()) == ["office.topo.json"]


def test_link_to_a_map_stays_a_link(path, tmp_path):
    link = tmp_path / "link.topo.json"
    link.symlink_to(path)
    file = MapFile(link)
    file.save(ONE_NODE, file.version())
    assert link.is_symlink()
    assert load_map(path) == ONE_NODE


@pytest.mark.parametrize("content", [b"", b"{", b"[]", b'{"version": 1}', b"\xff", b"x" * 100])
def test_broken_file_is_named_and_left_alone(path, content):
    path.write_bytes(content)
    with pytest.raises(InputError) as caught:
        MapFile(path).open()
    assert str(path) in str(caught.value)
    assert path.read_bytes() == content


def test_folder_is_no_map(tmp_path):
    with pytest.raises(InputError, match="folder"):
        MapFile(tmp_path)
