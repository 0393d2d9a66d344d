"""Read XML as leniently as TinyXML, with which C++ programs read robot descriptions and plugin descriptions.

Many public files have mistakes that TinyXML accepts: white space, a byte order mark or comments before the
declaration, `--` in a comment, an `&` that begins no entity, and text after the root element. Lines and
columns stay those of the original text, except after an `&` in the same line. Document types stay refused.
"""

from __future__ import annotations

import re

from pipros.safe.xml import Element, parse

_DECLARATIONS = re.compile(r"(?:[\ufeff \t\r\n]*<\?xml.*?\?>)*", re.DOTALL)


def parse_tolerantly(text: str, file: str = "<string>") -> Element:
    """Return the root element of a document.

    Raises:
        XmlError: see `pipros.safe.xml.parse`.
    """
    return parse(strict_text(text), file, ignores_rest=True)


def strict_text(text: str) -> str:
    """Return the text without declarations before the root element and, if it has no CDATA, without comments.

    The removed parts are replaced by spaces.
    """
    if "<![CDATA[" not in text:
        text = _without_comments(text)
        text = re.sub(r"&(?!(?:amp|lt|gt|quot|apos|#[0-9]+|#x[0-9a-fA-F]+);)", "&amp;", text)
    end = _DECLARATIONS.match(text).end()  # type: ignore[union-attr] # it also matches nothing
    return (_blank(text[:end]) + text[end:]).removeprefix("\ufeff")


def _without_comments(text: str) -> str:
    parts, end = [], 0
    while (start := text.find("<!--", end)) >= 0 and (closed := text.find("-->", start + 4)) >= 0:
        parts += [text[end:start], _blank(text[start : closed + 3])]
        end = closed + 3
    return "".join([*parts, text[end:]])


def _blank(text: str) -> str:
    return re.sub(r"[^\r\n]", " ", text)
