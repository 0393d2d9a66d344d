"""Read XML as leniently as TinyXML, with which C++ programs read robot descriptions and plugin descriptions.

Many public files have mistakes that TinyXML accepts: white space, a byte order mark or comments before the
declaration, `--` in a comment, an `&` that begins no entity, `<` in a value, values without quotation marks,
attributes without a space between them, control characters, and text after the root element. Lines and
columns stay those of the original text, except after such a mistake in the same line. A document type with
declarations stays refused; any other is ignored.
"""

from __future__ import annotations

import contextlib
import re

from pipros.safe.xml import Element, XmlError, parse

# Each alternative also matches markup that does not end, so that reading takes linear time. A repeated group
# needs memory for each repetition; what follows the limit in a tag is treated as text.
_MARKUP = re.compile(
    r"""(?P<dropped> <!-- (?: .*?--> | .* ) | <\?.*?\?> | <\?.*\Z | <![A-Z][^<>\[]*> )
    | (?P<kept> <!\[CDATA\[ (?: .*?\]\]> | .* ) | <! )
    | (?P<tag> < [^\s<>"'/!?=] (?: [^<>"']+ | "[^"]*" | '[^']*' ){0,10000} )
    | (?P<text> [^<]+ )""",
    re.DOTALL | re.VERBOSE,
)
_ATTRIBUTE = re.compile(
    r"""(?<=[\s"']) ([^\s=<>"'/]+) (\s*=\s*) (?: "([^"]*)" | '([^']*)' | ([^\s<>"'/=][^\s<>"'/]*) )""",
    re.VERBOSE,
)
_NO_ENTITY = re.compile(r"&(?!(?:amp|lt|gt|quot|apos|#[0-9]+|#x[0-9a-fA-F]+);)")
_REFERENCE = re.compile(r"&#(x?)([0-9a-fA-F]+);")
_CONTROL = re.compile("[\x01-\x08\x0b\x0c\x0e-\x1f\ufffe\uffff]")


def parse_tolerantly(text: str, file: str = "<string>") -> Element:
    """Return the root element of a document.

    Raises:
        XmlError: see `pipros.safe.xml.parse`.
    """
    with contextlib.suppress(XmlError):
        return parse(text, file)
    return parse(strict_text(text), file, ignores_rest=True)


def strict_text(text: str) -> str:
    """Return the text without declarations, contents of comments, and mistakes.

    Spaces replace what is removed. As in C, the text ends at its first NUL.
    """
    text = _CONTROL.sub(" ", text.partition("\0")[0].removeprefix("\ufeff"))
    return _MARKUP.sub(_strict, text)


def _strict(found: re.Match[str]) -> str:
    part = found[0]
    if found["dropped"]:
        is_comment = part.startswith("<!--") and part.endswith("-->")
        return f"<!--{_blank(part[4:-3])}-->" if is_comment else _blank(part)
    if found["tag"]:
        return _ATTRIBUTE.sub(_attribute, part)
    return _escaped(part).replace("]]>", "]]&gt;") if found["text"] else part


def _blank(text: str) -> str:
    return re.sub(r"[^\r\n]", " ", text)


def _attribute(found: re.Match[str]) -> str:
    name, sign, *values = found.groups()
    value = next(each for each in values if each is not None)
    quote = "'" if values[1] is not None else '"'
    before = "" if found.string[found.start() - 1].isspace() else " "
    return f"{before}{name}{sign}{quote}{_escaped(value).replace('<', '&lt;')}{quote}"


def _escaped(text: str) -> str:
    """Escape each `&` that begins neither an entity nor the number of a character."""
    return _REFERENCE.sub(_reference, _NO_ENTITY.sub("&amp;", text)) if "&" in text else text


def _reference(found: re.Match[str]) -> str:
    digits = found[2].lstrip("0")[:9] or "0"
    number = int(digits, 16 if found[1] else 10) if found[1] or digits.isdecimal() else 0
    is_valid = number in (9, 10, 13) or 32 <= number < 0xD800 or 0xE000 <= number < 0x110000
    return found[0] if is_valid and number not in (0xFFFE, 0xFFFF) else f"&amp;{found[0][1:]}"
