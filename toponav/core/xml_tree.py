"""XML of strangers: no entities, no document types, bounded depth and number of elements."""

import xml.etree.ElementTree as ElementTree
from xml.etree.ElementTree import Element
from xml.parsers import expat

from toponav.core.errors import InputError

__all__ = ["parse_xml"]


class _RefusedError(Exception):
    """What a document may not hold."""


def parse_xml(
    data: bytes, where: str, *, max_depth: int = 200, max_elements: int = 1_000_000
) -> Element:
    """The root of a document; tags and attributes are bare of namespace prefixes.

    Entities other than the five of XML itself are refused, so nothing expands and nothing
    outside the document is read.

    Args:
        data: The document.
        where: The file that it came from, for messages.
        max_depth: Most elements inside one another.
        max_elements: Most elements in all.

    Raises:
        InputError: It is no XML, or holds a document type, an entity, or too much.

    Example:
        >>> parse_xml(b"<a><x:b/></a>", "example")[0].tag
        'b'
    """
    builder = ElementTree.TreeBuilder()
    depth = count = 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth, count
        depth, count = depth + 1, count + 1
        if depth > max_depth:
            raise _RefusedError(f"more than {max_depth} elements inside one another")
        if count > max_elements:
            raise _RefusedError(f"more than {max_elements:,} elements")
        builder.start(_bare(tag), {_bare(name): value for name, value in attributes.items()})

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(_bare(tag))

    def refuse_entity(*_: object) -> None:
        raise _RefusedError("an entity declared in the document")

    def refuse_reference(*_: object) -> int:
        raise _RefusedError("an entity outside the document")

    def refuse_doctype(name: str, system: str | None, public: str | None, internal: int) -> None:
        # A plain `<!DOCTYPE sdf>` says nothing and harms nothing.
        if system or public or internal:
            raise _RefusedError("a document type")

    parser = expat.ParserCreate()
    parser.buffer_text = True
    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = builder.data
    parser.EntityDeclHandler = refuse_entity
    parser.ExternalEntityRefHandler = refuse_reference
    parser.StartDoctypeDeclHandler = refuse_doctype
    try:
        parser.Parse(data, True)
        return builder.close()
    except _RefusedError as error:
        line = parser.CurrentLineNumber
        raise InputError(
            f"{error} is not read",
            where=f"{where} line {line}",
            remedy="remove it, or export the file again from the program that made it",
        ) from None
    except expat.ExpatError as error:
        raise InputError(
            f"is not XML ({expat.errors.messages.get(error.code, error)})",
            where=f"{where} line {error.lineno}",
            remedy="repair that line, or export the file again",
        ) from None
    except (ValueError, LookupError, AssertionError, TypeError) as error:
        raise InputError(
            f"is not XML ({error})", where=where, remedy="export the file again"
        ) from None


def _bare(name: str) -> str:
    return name.rpartition(":")[2]
