"""What the documentation names exists, and the commands it shows can be typed."""

import functools
import inspect
import json
import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import tyro

from toponav.cli import main as program

ROOT = Path(__file__).parent.parent
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])
SCRIPTS = sorted((ROOT / "examples").glob("*.sh"))


def named(path: Path) -> str:
    return str(path.relative_to(ROOT))


def code_lines(page: Path) -> Iterator[str]:
    """Lines of fenced and indented code, joined where they end in a backslash."""
    fenced, pending = False, ""
    for line in page.read_text(encoding="utf-8").splitlines():
        if line.startswith("```"):
            fenced = not fenced
        elif fenced or line.startswith("    "):
            pending += line.strip().removesuffix("\\")
            if not line.endswith("\\"):
                yield pending
                pending = ""


def commands_in(path: Path) -> Iterator[list[str]]:
    """The words after `toponav` of each command that a page or a script shows."""
    if path.suffix == ".sh":
        text = path.read_text(encoding="utf-8").replace("\\\n", " ")
        lines: Iterator[str] = iter(text.replace('"$toponav"', "toponav").splitlines())
    else:
        lines = code_lines(path)
    for line in lines:
        words = re.sub(r"^(\$ |[A-Z_]+=\S+ )+", "", line.strip().removesuffix("&"))
        if words.startswith("toponav "):
            without_expansions = re.sub(r"\$\{\w+:\+([^}]*)\}", r"\1", words)
            with_values = re.sub(r"\$\{?\w+\}?", "2", without_expansions)
            yield shlex.split(with_values, comments=True)[1:]


def examples_of_help() -> Iterator[list[str]]:
    """The commands that the help texts show."""
    for word in program._MODULES:
        for path, command in program._commands(word).items():
            text = inspect.getdoc(command) or ""
            joined = re.sub(r"\n(?=--|\S+\.yaml)", " ", text)
            for line in joined.splitlines():
                _, found, rest = line.partition("toponav ")
                if found and rest.split()[: len(path)] == list(path):
                    yield shlex.split(rest.replace(" ...", ""))


def parse(words: list[str]) -> None:
    """Parse a command line as the program would, without running it."""
    if words in (["--version"], ["--help"]):
        return
    commands = program._commands(words[0])
    length = next(size for size in (3, 2, 1) if tuple(words[:size]) in commands)
    command = commands[tuple(words[:length])]

    @functools.wraps(command)
    def stand_in(*positional: Any, **named: Any) -> None:
        """Runs nothing."""

    tyro.cli(stand_in, args=words[length:], prog="toponav")


def shown() -> list[Any]:
    found = [(named(path), words) for path in PAGES + SCRIPTS for words in commands_in(path)]
    found += [("help", words) for words in examples_of_help()]
    return [pytest.param(words, id=f"{where}: {' '.join(words)[:60]}") for where, words in found]


@pytest.mark.parametrize("words", shown())
def test_command_can_be_typed(words):
    try:
        parse(words)
    except SystemExit as exit_:
        if exit_.code:
            pytest.fail(f"toponav {shlex.join(words)} is refused")


def test_every_command_is_shown_somewhere():
    said = {tuple(words[:3]) for path in PAGES for words in commands_in(path)}
    for word in program._MODULES:
        for path in program._commands(word):
            if path != ("scene", "generate", "home"):
                assert any(one[: len(path)] == path for one in said), f"no page shows {path}"


@pytest.mark.parametrize("page", PAGES, ids=named)
def test_links_lead_somewhere(page):
    for target in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
        if "://" not in target:
            assert (page.parent / target).exists(), f"{named(page)} links to {target}"


@pytest.mark.parametrize("page", sorted((ROOT / "docs" / "papers").glob("*.md")), ids=named)
def test_rows_of_a_paper_name_files_and_tests_that_exist(page):
    rows = [line.split("|") for line in page.read_text(encoding="utf-8").splitlines()]
    rows = [[cell.strip() for cell in row] for row in rows if len(row) > 5]
    assert len(rows) > 10
    for _, claim, ours, test, *_ in rows[2:]:
        for path in re.findall(r"`([^`]+)`", ours):
            assert (ROOT / "toponav" / path).exists(), f"{claim}: toponav/{path}"
        for path in re.findall(r"`([^`]+)`", test):
            assert (ROOT / path).exists(), f"{claim}: {path}"


def test_files_named_in_pages_exist():
    for page in PAGES:
        for path in re.findall(r"`((?:toponav|tests|docs|examples)/[\w./]+)`", page.read_text()):
            assert (ROOT / path).exists(), f"{named(page)} names {path}"


def test_make_targets_exist():
    targets = set(re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    for page in PAGES:
        for line in code_lines(page):
            for target in re.findall(r"(?:^|&& )make ([\w-]+)", line):
                assert target in targets, f"{named(page)} says make {target}"


def test_python_in_pages_runs():
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        for code in re.findall(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL):
            exec(compile(code, named(page), "exec"), {})


def test_json_in_the_maps_page_is_a_map():
    from toponav.maps.spec import map_from_document

    text = (ROOT / "docs" / "maps.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"^```json\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    assert len(map_from_document(json.loads(code)).edges) == 1
