"""YAML of strangers: plain values only, with bounds that no alias or nesting can get around."""

import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import yaml

from toponav.core.errors import InputError, shown

__all__ = ["parse_yaml"]

_MOST_VALUES = 500_000
_MOST_LEVELS = 64
_MOST_DIGITS = 19
_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_TAG = "tag:yaml.org,2002:"
_PLAIN_TAGS = frozenset({f"{_TAG}{name}" for name in ("str", "int", "float", "bool", "null")})
_COLLECTION_TAGS = frozenset({f"{_TAG}seq", f"{_TAG}map"})
_RESOLVERS: dict[str, list[tuple[str, re.Pattern[str]]]] = yaml.SafeLoader.yaml_implicit_resolvers
_SURROGATE = re.compile("[\ud800-\udfff]")
_TRUE = frozenset({"yes", "true", "on"})


def parse_yaml(data: bytes, where: str) -> Any:
    """What one YAML document holds: mappings from text, lists, text, numbers, truth, None.

    Keys are the text that stands there; dates and base-60 numbers stay text. Aliases are
    followed as long as the document would stay small with all of them written out.

    Args:
        data: UTF-8 text.
        where: The file that it came from, for messages.

    Raises:
        InputError: If it is not YAML, or has tags, merge keys, repeated keys, aliases of what
            contains them, more than 64 levels, or more than half a million values; names the line.
    """
    try:
        text = data.decode("utf-8-sig")
        return _Builder(where).build(yaml.parse(text, Loader=_LOADER))
    except InputError:
        raise
    except UnicodeDecodeError as error:
        raise InputError(
            f"not UTF-8 at byte {error.start}", where=where, remedy="save the file as UTF-8 text"
        ) from None
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        raise InputError(
            f"is not YAML: {error.problem or error.context}",
            where=f"{where} line {mark.line + 1}" if mark else where,
            remedy="repair the line, or save the file again from the tool that made it",
        ) from None
    except (yaml.YAMLError, ValueError) as error:
        raise InputError(
            f"is not YAML: {str(error).splitlines()[0][:120] if str(error) else 'unreadable'}",
            where=where,
            remedy="save the file again from the tool that made it",
        ) from None


@dataclass
class _Open:
    """A list or a mapping whose end has not come yet."""

    value: "list[Any] | dict[str, Any]"
    anchor: str | None
    size_before: int
    key: str | None = None


@dataclass
class _Builder:
    where: str
    size: int = 0
    stack: list[_Open] = field(default_factory=list)
    anchors: dict[str, tuple[Any, int]] = field(default_factory=dict)
    documents: int = 0
    root: Any = None

    def build(self, events: Iterable[Any]) -> Any:
        for event in events:
            if isinstance(event, yaml.ScalarEvent):
                self._grow(1, event)
                self._add_scalar(event)
            elif isinstance(event, yaml.CollectionStartEvent):
                self._open(event)
            elif isinstance(event, yaml.CollectionEndEvent):
                done = self.stack.pop()
                if done.anchor is not None:
                    self.anchors[done.anchor] = done.value, self.size - done.size_before
                self._add(done.value, event)
            elif isinstance(event, yaml.AliasEvent):
                self._add_alias(event)
            elif isinstance(event, yaml.DocumentStartEvent):
                self.documents += 1
                if self.documents > 1:
                    raise self._fault("one document is read, a second begins", event)
        return self.root

    def _open(self, event: Any) -> None:
        before = self.size
        self._grow(1, event)
        if len(self.stack) >= _MOST_LEVELS:
            raise self._fault(f"more than {_MOST_LEVELS} levels of lists and mappings", event)
        if event.tag not in (None, "!") and event.tag not in _COLLECTION_TAGS:
            raise self._fault(f"tags such as {event.tag[:60]} are not read", event)
        if self.stack and isinstance(self.stack[-1].value, dict) and self.stack[-1].key is None:
            raise self._fault("a key must be text, got a list or a mapping", event)
        is_mapping = isinstance(event, yaml.MappingStartEvent)
        self.anchors.pop(event.anchor or "", None)
        self.stack.append(_Open({} if is_mapping else [], event.anchor, before))

    def _add_alias(self, event: Any) -> None:
        found = self.anchors.get(event.anchor)
        if found is None:
            raise self._fault(f"*{event.anchor[:60]} stands for nothing that came before", event)
        value, size = found
        self._grow(size, event)
        is_key = bool(self.stack) and isinstance(self.stack[-1].value, dict)
        if is_key and self.stack[-1].key is None:
            raise self._fault("a key must be text, got an alias", event)
        self._add(value, event)

    def _add_scalar(self, event: Any) -> None:
        if event.tag not in (None, "!") and event.tag not in _PLAIN_TAGS:
            raise self._fault(f"tags such as {event.tag[:60]} are not read", event)
        if not event.value.isascii() and _SURROGATE.search(event.value):
            raise self._fault("text must be Unicode, got a lone surrogate", event)
        top = self.stack[-1] if self.stack else None
        if top is not None and isinstance(top.value, dict) and top.key is None:
            if event.value == "<<" and event.implicit[0]:
                raise self._fault("merge keys (<<) are not read", event)
            if event.value in top.value:
                raise self._fault(f"the key {shown(event.value)} comes twice", event)
            top.key = event.value
            return
        value = self._value_of(event)
        if event.anchor is not None:
            self.anchors[event.anchor] = value, 1
        self._add(value, event)

    def _add(self, value: Any, event: Any) -> None:
        if not self.stack:
            self.root = value
            return
        top = self.stack[-1]
        if isinstance(top.value, list):
            top.value.append(value)
        else:
            assert top.key is not None
            top.value[top.key] = value
            top.key = None

    def _value_of(self, event: Any) -> Any:
        text, tag = event.value, event.tag
        if tag in (None, "!"):
            tag = self._tag_of(text) if event.implicit[0] and tag is None else f"{_TAG}str"
        try:
            if tag == f"{_TAG}null":
                return None
            if tag == f"{_TAG}bool":
                return text.lower() in _TRUE
            if tag == f"{_TAG}int" and ":" not in text:
                return _whole_number(text)
            if tag == f"{_TAG}float" and ":" not in text:
                return _real_number(text)
        except ValueError as error:
            raise self._fault(str(error) or f"is no number: {shown(text)}", event) from None
        return text

    @staticmethod
    def _tag_of(text: str) -> str:
        for tag, pattern in _RESOLVERS.get(text[:1], ()):
            if pattern.match(text):
                return tag
        return f"{_TAG}str"

    def _grow(self, by: int, event: Any) -> None:
        self.size += by
        if self.size > _MOST_VALUES:
            raise self._fault(
                f"more than {_MOST_VALUES:,} values, with its aliases written out", event
            )

    def _fault(self, rule: str, event: Any) -> InputError:
        line = f" line {event.start_mark.line + 1}" if event.start_mark else ""
        return InputError(
            rule, where=f"{self.where}{line}", remedy="write plain values, each key once"
        )


def _whole_number(text: str) -> int:
    digits = text.replace("_", "").lower()
    if len(digits.lstrip("+-0")) > _MOST_DIGITS:
        raise ValueError(f"whole numbers must fit 64 bits, got one of {len(digits)} digits")
    bare = digits.lstrip("+-")
    base = 2 if bare[:2] == "0b" else 16 if bare[:2] == "0x" else 8 if bare[:1] == "0" else 10
    return int(digits, base)


def _real_number(text: str) -> float:
    return float(text.replace("_", "").lower().replace(".inf", "inf").replace(".nan", "nan"))
