import math
from typing import Any

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from toponav.core.errors import InputError
from toponav.core.yaml_text import parse_yaml

_text = st.text(st.characters(exclude_categories=("Cs",)), max_size=12)
_plain = (
    st.none() | st.booleans() | st.integers(-(2**62), 2**62) | st.floats(allow_nan=False) | _text
)
_documents = st.recursive(
    _plain, lambda inner: st.lists(inner, max_size=4) | st.dictionaries(_text, inner, max_size=4)
)


@settings(max_examples=60, deadline=None)
@given(document=_documents, flow=st.booleans())
def test_what_pyyaml_writes_is_read_as_it_was(document: Any, flow: bool) -> None:
    text = yaml.safe_dump(document, default_flow_style=flow)
    assert parse_yaml(text.encode(), "a.yaml") == document


@settings(max_examples=60, deadline=None)
@given(text=st.text(st.characters(codec="utf-8"), max_size=40))
def test_any_text_is_read_or_refused(text: str) -> None:
    try:
        parse_yaml(text.encode(), "a.yaml")
    except InputError as error:
        place = error.where
    else:
        place = "a.yaml"
    assert place.startswith("a.yaml")


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("", None),
        ("~", None),
        ("[yes, No, on, OFF]", [True, False, True, False]),
        ("[10, 0x1F, 010, 0b101, -3, 1_000]", [10, 31, 8, 5, -3, 1000]),
        ("[1.5, 1e5, 1.0e+5, .5, 1_0.5]", [1.5, "1e5", 1e5, 0.5, 10.5]),
        ("[12:30, 2001-12-14, 2001-99-99]", ["12:30", "2001-12-14", "2001-99-99"]),
        ("{1: a, true: b, ~: c}", {"1": "a", "true": "b", "~": "c"}),
        ("a: &x [1, {b: 2}]\nc: *x", {"a": [1, {"b": 2}], "c": [1, {"b": 2}]}),
        ("a: &x 1\nb: &x 2\nc: *x", {"a": 1, "b": 2, "c": 2}),
        ("!!str 12", "12"),
        ("'12'", "12"),
        ("\ufeffa: 1", {"a": 1}),
        ("a: |\n  two\n  lines\n", {"a": "two\nlines\n"}),
    ],
)
def test_values_are_those_of_yaml(text: str, value: Any) -> None:
    assert parse_yaml(text.encode(), "a.yaml") == value


def test_numbers_without_a_value_are_told_apart() -> None:
    infinite, negative, missing = parse_yaml(b"[.inf, -.INF, .nan]", "a.yaml")
    assert (infinite, negative) == (math.inf, -math.inf)
    assert math.isnan(missing)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("a: 1\nb: [", r"a\.yaml line 3: is not YAML"),
        ("a: 1\na: 2", r"a\.yaml line 2: the key 'a' comes twice"),
        ("a: 1\n--- 2", r"line 2: .*|a second begins"),
        ("a: &x [*x]", "stands for nothing that came before"),
        ("a: *x", r"\*x stands for nothing"),
        ("a: !!python/object:os.system x", "tags such as .*python/object"),
        ("a: !!binary aGk=", "tags such as"),
        ("a: !mine {}", "tags such as !mine"),
        ("<<: {a: 1}", "merge keys"),
        ("? [1]\n: 2", "a key must be text, got a list"),
        ("? &a b\n: 2\n*a : 3", "a key must be text, got an alias|stands for nothing"),
        ("a: " + "9" * 30, "whole numbers must fit 64 bits, got one of 30 digits"),
        ("[" * 65 + "]" * 65, "more than 64 levels"),
        ("a: \x01", "is not YAML"),
        ("!!int x", "line 1: .*x"),
    ],
)
def test_what_is_not_read_is_named_with_its_line(text: str, says: str) -> None:
    with pytest.raises(InputError, match=says):
        parse_yaml(text.encode(), "a.yaml")


def test_aliases_may_not_unfold_into_too_much() -> None:
    lines = ["a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    lines += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 7)]
    with pytest.raises(InputError, match=r"line 6: more than 500,000 values, with its aliases"):
        parse_yaml("\n".join(lines).encode(), "a.yaml")
    assert parse_yaml("\n".join(lines[:4]).encode(), "a.yaml")["a3"][9][9][9][9] == 1


def test_other_encodings_are_refused() -> None:
    with pytest.raises(InputError, match="not UTF-8 at byte 3"):
        parse_yaml("a: ä".encode("latin-1"), "a.yaml")
