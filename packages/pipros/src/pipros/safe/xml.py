"""Read XML files into elements with line and column numbers. Document types and entities are rejected.

A document type can define entities that expand to gigabytes or read other files. ROS files do not need a
document type, so any `<!DOCTYPE` is an error.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from xml.parsers import expat

from pipros.basics.errors import PiprosError

XML_BYTES = 16 * 1024 * 1024
"""Limit: an XML file. Beyond it, the file is refused."""
XML_DEPTH = 100
"""Limit: nesting of elements in an XML file. Beyond it, the file is refused."""

_JUNK_AFTER_ROOT = 9
"""Expat's code of the error that something follows the root element."""


class XmlError(PiprosError):
    """A document is not well-formed XML, has a document type, or exceeds a limit.

    Attributes:
        file: the name of the file, or `<string>`.
        line: counted from 1.
        column: counted from 1.
    """

    def __init__(self, file: str, line: int, column: int, reason: str) -> None:
        self.file = file
        self.line = line
        self.column = column
        self.reason = reason
        super().__init__(f"{file}:{line}:{column}: {reason}")


@dataclass(slots=True)
class Element:
    """One element: its tag, attributes, children in order, own text, and the position of its `<`."""

    tag: str
    attributes: Mapping[str, str]
    line: int
    column: int
    children: list[Element] = field(default_factory=list)
    text: str = ""

    def all(self, tag: str) -> Iterator[Element]:
        """Return the direct children whose tag is `tag`."""
        return (child for child in self.children if child.tag == tag)

    def first(self, tag: str) -> Element | None:
        """Return the first direct child whose tag is `tag`, or None if there is none."""
        return next(self.all(tag), None)


def parse(
    content: bytes | str,
    file: str = "<string>",
    *,
    ignores_rest: bool = False,
) -> Element:
    """Return the root element of a document.

    An element's text is the concatenation of all text between its children and comments.

    Args:
        ignores_rest: whether to ignore text and elements after the root element.

    Raises:
        XmlError: the XML is malformed, has a document type, or exceeds the limits on nesting or size.
    """
    depth_limit = XML_DEPTH
    if len(content) > XML_BYTES:
        raise XmlError(file, 1, 1, f"the text is larger than {XML_BYTES} bytes")
    # Decoded text may still declare the encoding of the original bytes.
    parser = expat.ParserCreate("utf-8" if isinstance(content, str) else None)
    parser.buffer_text = True
    roots: list[Element] = []
    stack: list[Element] = []
    texts: list[list[str]] = []

    def place() -> tuple[int, int]:
        return parser.CurrentLineNumber, parser.CurrentColumnNumber + 1

    def open_element(tag: str, attributes: dict[str, str]) -> None:
        line, column = place()
        if len(stack) >= depth_limit:
            raise XmlError(file, line, column, f"elements are nested more than {depth_limit} deep")
        element = Element(tag, attributes, line, column)
        (stack[-1].children if stack else roots).append(element)
        stack.append(element)
        texts.append([])

    def close_element(_tag: str) -> None:
        stack.pop().text = "".join(texts.pop())

    def add_text(text: str) -> None:
        texts[-1].append(text)

    def refuse_document_type(*_declaration: object) -> None:
        raise XmlError(file, *place(), "a document type (<!DOCTYPE …>) is not allowed")

    parser.StartElementHandler = open_element
    parser.EndElementHandler = close_element
    parser.CharacterDataHandler = add_text
    parser.StartDoctypeDeclHandler = refuse_document_type
    parser.EntityDeclHandler = refuse_document_type
    try:
        parser.Parse(content.encode("utf-8", "surrogatepass") if isinstance(content, str) else content, True)
    except expat.ExpatError as error:
        if ignores_rest and error.code == _JUNK_AFTER_ROOT:
            return roots[0]
        reason = expat.ErrorString(error.code) or "not well-formed"
        raise XmlError(file, error.lineno, error.offset + 1, f"invalid XML: {reason}") from None
    except (LookupError, ValueError) as error:
        raise XmlError(file, *place(), f"invalid XML: {error}") from None
    return roots[0]
