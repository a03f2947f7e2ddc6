"""The editor as a user uses it, in Chromium."""

import json

import pytest

pytest.importorskip("starlette", reason="the editor needs the extra 'editor'")

from tests.maps.editor.editor_page import EditorPage
from tests.maps.editor.served import running
from tests.maps.editor.small_office import EDGES, NODES
from toponav.core.vocabulary import Behavior, NodeKind
from toponav.maps.editor.floor import Floor
from toponav.maps.editor.work import Workshop
from toponav.maps.spec import MapFrame, TopologicalMap, load_map, map_to_document, save_map
from toponav.maps.validate import validate
from toponav.worlds.generate.office import generate_office

pytestmark = pytest.mark.browser

OFFICE = TopologicalMap("office", MapFrame(), NODES, EDGES)


@pytest.fixture
def office(page, tmp_path):
    """The editor with a small office."""
    path = save_map(OFFICE, tmp_path / "office.topo.json")
    with running(path) as url:
        yield EditorPage(page, path).open(url)


def test_map_is_drawn_from_nothing_undone_mended_saved_and_reloaded(page, tmp_path):
    path = tmp_path / "drawn.topo.json"
    with running(path) as url:
        editor = EditorPage(page, path).open(url)
        # A corridor of two lanes, a room and its door.
        editor.press("c")
        editor.click_at(0.2, 0.75)
        editor.click_at(0.8, 0.75)
        editor.press("Escape", "n", "r")
        editor.click_at(0.5, 0.25)
        editor.press("d")
        editor.click_at(0.5, 0.45)
        # An edge too many, and a find_door that leads the wrong way.
        editor.connect("room-1", "room-1_door")
        editor.connect("hallway-1", "room-1")
        editor.connect("room-1_door", "hallway-3")
        editor.connect("hallway-1", "hallway-4")
        editor.press("Control+z")
        page.wait_for_selector('[data-edge="hallway-1->hallway-4"]', state="detached")
        editor.connect("hallway-1", "room-1_door")
        # The reported fault is gone to by a click, and mended.
        fault = page.locator(".fault", has_text="rule 5")
        fault.click()
        assert "hallway-1->room-1_door" in editor.text("#inspector")
        editor.press("Delete")
        editor.wait(lambda: not fault.count(), "fault mended")
        drawn = editor.saved()
        assert {node.id: node.kind for node in drawn.nodes} == {
            "hallway-1": NodeKind.HALLWAY,
            "hallway-2": NodeKind.HALLWAY,
            "hallway-3": NodeKind.HALLWAY,
            "hallway-4": NodeKind.HALLWAY,
            "room-1": NodeKind.ROOM,
            "room-1_door": NodeKind.DOOR,
        }
        assert {edge.id: edge.behavior for edge in drawn.edges} == {
            "hallway-1->hallway-3": Behavior.CORRIDOR_FOLLOW,
            "hallway-4->hallway-2": Behavior.CORRIDOR_FOLLOW,
            "room-1->room-1_door": Behavior.FIND_DOOR,
            "hallway-1->room-1": Behavior.TURN_LEFT,
            "room-1_door->hallway-3": Behavior.TURN_LEFT,
        }
        assert drawn.node("room-1_door").room == "room-1"
        assert not {fault.rule for fault in validate(drawn) if fault.rule.paper_number}
        lanes = [drawn.node(f"hallway-{number}") for number in (1, 2)]
        assert lanes[0].y_m < lanes[1].y_m, "lanes drive on the right"
        page.reload()
        page.wait_for_selector("body[data-ready=true]")
        assert page.locator("[data-node]").count() == 6
        assert page.locator("[data-edge]").count() == 5
        assert load_map(path) == drawn


def test_everything_can_be_undone_and_done_again(office):
    page = office.page
    office.click_node("office")
    office.press("ArrowRight", "Shift+ArrowUp", "h", "Delete", "Control+a", "Delete")
    assert page.locator("[data-node]").count() == 0
    while page.locator("#undo").is_enabled():
        office.press("Control+z")
    office.wait(lambda: page.locator("[data-node]").count() == len(NODES), "undone")
    assert office.saved() == OFFICE
    while page.locator("#redo").is_enabled():
        office.press("Control+y")
    assert page.locator("[data-node]").count() == 0


def test_nodes_are_dragged_and_their_edges_follow(office):
    page = office.page
    x, y = office.node_at("office")
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 30, y - 40, steps=4)
    page.mouse.up()
    moved = office.saved()
    office_node = moved.node("office")
    assert office_node.x_m > 2.1
    assert office_node.y_m > 2.6
    for edge in (*moved.in_edges("office"), *moved.out_edges("office")):
        ends = moved.node(edge.source), moved.node(edge.target)
        assert edge.length_m == pytest.approx(ends[0].distance_to(ends[1]), abs=1e-6)
    assert moved.edge("hall-1->hall-3") == OFFICE.edge("hall-1->hall-3")


def test_what_comes_into_sight_is_drawn(office):
    page = office.page
    shown = "e => getComputedStyle(e).display !== 'none'"

    def is_drawn(node: str) -> bool:
        return bool(page.locator(f'[data-node="{node}"]').evaluate(shown))

    x, y = office.node_at("office")
    page.mouse.move(x, y)
    for _ in range(12):
        page.mouse.wheel(0, -200)
    office.wait(lambda: not is_drawn("store"), "far nodes are left out")
    assert office.node_at("office") == pytest.approx((x, y), abs=3)
    for _ in range(40):
        if is_drawn("store"):
            break
        page.mouse.move(x, y)
        page.mouse.down(button="right")
        page.mouse.move(x, y - 300, steps=2)
        page.mouse.up(button="right")
        page.wait_for_timeout(50)
    assert is_drawn("store")
    office.press("Home")
    office.wait(lambda: all(is_drawn(node.id) for node in NODES), "all is drawn")
    page.wait_for_timeout(300)
    assert office.node_at("office") == pytest.approx((x, y), abs=3)


def test_band_selects_and_what_is_copied_is_pasted_with_its_edges(office):
    page = office.page
    left, top = office.node_at("office")
    right, bottom = office.node_at("office_door")
    page.mouse.move(left - 30, top - 30)
    page.mouse.down()
    page.mouse.move(right + 30, bottom + 20, steps=3)
    page.mouse.up()
    assert "2 nodes, 1 edge" in office.text("#inspector")
    office.press("Control+c", "Control+v")
    pasted = office.saved()
    assert len(pasted.nodes) == len(NODES) + 2
    new = next(edge for edge in pasted.edges if edge.id not in OFFICE.edge_index)
    assert (new.source, new.target, new.behavior) == (
        "office-2", "office_door-2", Behavior.FIND_DOOR
    )  # fmt: skip


def test_single_keys_set_kinds_and_behaviours(office):
    office.click_node("store")
    office.press("o")
    office.press("/")
    office.page.keyboard.type("hall-1 store")
    office.press("Enter", "5")
    saved = office.saved()
    assert saved.node("store").kind is NodeKind.OPEN_SPACE
    assert saved.edge("hall-1->store").behavior is Behavior.STRAIGHT


def test_names_fields_and_lists_change_the_map(office):
    page = office.page
    office.click_node("store")
    page.fill("#node-name", "cellar")
    page.press("#node-name", "Enter")
    page.fill("#node-x", "1.25")
    page.press("#node-x", "Enter")
    page.fill("#node-name", "office")
    page.press("#node-name", "Enter")
    saved = office.saved()
    assert saved.node("cellar").x_m == 1.25
    assert saved.edge_between("cellar", "store_door").id == "cellar->store_door"
    assert saved.node("office") == OFFICE.node("office")


def test_fields_built_anew_keep_what_is_marked_and_typed(office):
    page = office.page
    office.click_node("store")
    page.fill("#node-x", "1.25")
    # Leaving x sets it; the fields are built anew a frame after the name is marked.
    page.evaluate(
        """async () => {
          const name = document.getElementById("node-name");
          name.focus();
          name.select();
          const frame = () => new Promise(requestAnimationFrame);
          await frame();
          await frame();
        }"""
    )
    page.keyboard.type("cellar")
    page.keyboard.press("Enter")
    saved = office.saved()
    assert "store" not in saved.node_index
    assert saved.node("cellar").x_m == 1.25


def test_plan_between_two_clicked_rooms_names_its_behaviours(office):
    office.press("p")
    office.click_node("office")
    office.click_node("store")
    office.wait(lambda: office.page.locator(".step").count() == 2, "plan")
    steps = office.page.locator(".step b").all_inner_texts()
    assert steps == ["Find door", "Straight"]
    assert office.page.locator(".trail path").count() == 1


def test_suggested_behaviours_are_applied_once_agreed(office):
    page = office.page
    office.press("Control+f")
    page.keyboard.type("hall-4->store")
    office.press("Enter", "1", "s")
    assert "hall-4->store" in office.text("dialog")
    page.get_by_role("button", name="Apply").click()
    assert office.saved() == OFFICE


def test_change_on_disk_is_noticed_and_nothing_is_lost(office):
    page, path = office.page, office.path
    other = TopologicalMap("other", MapFrame(), NODES[:3], ())
    save_map(other, path)
    office.click_node("office")
    office.press("ArrowRight", "Control+s")
    page.get_by_role("button", name="Save mine as a copy").click()
    office.wait(lambda: page.locator("[data-node]").count() == 3, "reloaded")
    copy = load_map(path.with_name("office.copy-1.topo.json"))
    assert copy.node("office").x_m == pytest.approx(2.05)
    assert load_map(path) == other
    save_map(OFFICE, path)
    page.get_by_role("button", name="Overwrite it").click()
    office.wait(lambda: load_map(path).nodes == NODES[:3], "overwritten")
    assert load_map(path.with_name("office.overwritten-1.topo.json")) == OFFICE


def test_map_is_drawn_by_keys_alone(page, tmp_path):
    path = tmp_path / "keys.topo.json"
    with running(path) as url:
        editor = EditorPage(page, path).open(url)
        editor.press("n", "r", "Enter", "d", *["Shift+ArrowDown"] * 2, "Enter")
        editor.press("v", "e", "Enter", "Alt+ArrowUp", "Enter", "Escape", "Escape")
        drawn = editor.saved()
        assert [node.kind for node in drawn.nodes] == [NodeKind.ROOM, NodeKind.DOOR]
        assert [edge.id for edge in drawn.edges] == ["room-1_door->room-1"]
        editor.press(".", "]", "x", "2")
        assert [(edge.id, edge.behavior) for edge in editor.saved().edges] == [
            ("room-1->room-1_door", Behavior.FIND_DOOR)
        ]


def test_every_control_is_reached_by_tab_and_shows_it(office):
    page = office.page
    page.evaluate("document.activeElement.blur()")
    seen = set()
    for _ in range(60):
        office.press("Tab")
        name, visible = page.evaluate(
            """() => {
              const e = document.activeElement, s = getComputedStyle(e);
              const after = getComputedStyle(e, '::after');
              const shown = s.outlineStyle !== 'none' || after.borderTopStyle === 'solid';
              return [e.id || e.dataset.tool || e.textContent, shown];
            }"""
        )
        if page.evaluate("document.activeElement === document.body"):
            continue
        if name in seen:
            break
        assert visible, f"{name} has the focus and does not show it"
        seen.add(name)
    controls = {"search", "zoom-in", "zoom-out", "show-all", "theme", "help", "select", "node"}
    controls |= {"edge", "corridor", "plan", "suggest", "snap", "stage", "checks"}
    assert controls <= seen


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_no_serious_fault(browser, tmp_path, scheme):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright").Axe()
    scene = generate_office(3)
    path = save_map(OFFICE, tmp_path / "office.topo.json")
    context = browser.new_context(color_scheme=scheme, viewport={"width": 1280, "height": 800})
    with running(path, Workshop(), floor=Floor.of_scene(scene)) as url:
        page = context.new_page()
        editor = EditorPage(page, path).open(url)

        def serious(state: str) -> list[str]:
            # Colours are all that differs in the dark.
            options = {"runOnly": ["color-contrast"]} if scheme == "dark" else None
            found = axe.run(page, options=options).response["violations"]
            return [
                f"{state}: {one['id']}: {one['nodes'][0]['target']}"
                for one in found
                if one["impact"] in ("serious", "critical")
            ]

        faults = serious("map")
        editor.click_node("office")
        faults += serious("node")
        editor.press("/")
        page.keyboard.type("hall")
        faults += serious("search")
        editor.press("Enter", "p")
        editor.click_node("office")
        editor.click_node("store")
        page.wait_for_selector(".step")
        faults += serious("plan")
        editor.press("?")
        faults += serious("help")
    context.close()
    assert faults == []


def test_machine_built_map_is_one_edit(page, tmp_path):
    path = tmp_path / "built.topo.json"
    with running(path, Workshop(construct=lambda: OFFICE)) as url:
        editor = EditorPage(page, path).open(url)
        page.locator("#empty-build").click()
        page.wait_for_selector('[data-node="office"]')
        assert editor.saved().nodes == NODES
        assert page.locator(".node.error").count() == 0
        editor.press("Control+z")
        assert page.locator("[data-node]").count() == 0


def test_map_that_cannot_be_read_is_explained(browser, tmp_path):
    path = tmp_path / "broken.topo.json"
    path.write_text(json.dumps(map_to_document(OFFICE))[:100])
    page = browser.new_page()
    with running(path) as url:
        page.goto(url)
        page.wait_for_selector("body[data-ready=failed]")
        assert "not JSON" in page.locator("main").inner_text()
    page.close()
