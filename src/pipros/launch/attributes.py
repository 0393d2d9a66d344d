"""Typed access to the attributes of one element, with substitutions made and unknown ones noticed."""

from __future__ import annotations

from collections.abc import Iterable

from pipros.launch.model import LaunchError, Place
from pipros.launch.scope import Scope
from pipros.launch.substitute import UnsetArgument
from pipros.launch.values import convert_bool
from pipros.safe.xml import Element

_SHOWN_CHARACTERS = 200


class Attributes:
    """Reads an element in a scope. All errors name the element and its place."""

    def __init__(self, element: Element, scope: Scope) -> None:
        self._element = element
        self._scope = scope
        self.place = Place(scope.file, element.line, element.column)

    def error(self, reason: str) -> LaunchError:
        return LaunchError(reason, [self.place], shown(self._element))

    def text(self, name: str) -> str | None:
        """The attribute with its substitutions made; None when it is not written."""
        written = self._element.attributes.get(name)
        return None if written is None else self.resolve(written)

    def required(self, name: str) -> str:
        value = self.text(name)
        if value is None:
            raise self.error(f"<{self._element.tag}> tag is missing required attribute: '{name}'")
        return value

    def resolve(self, written: str) -> str:
        """Any text of this element with its substitutions made."""
        try:
            return self._scope.substitution.resolve(written)
        except UnsetArgument as error:
            raise self.error(f"[{self._scope.file}] {error}") from error
        except (ValueError, LookupError) as error:
            raise self.error(str(error)) from error

    def flag(self, name: str, *, default: bool = False) -> bool:
        """`true` or `false` in any case of letters."""
        value = self.text(name)
        if value is None:
            return default
        if not value:
            raise self.error(f"bool value for {name} must be non-empty")
        if value.lower() not in ("true", "false"):
            raise self.error(f"invalid bool value for {name}: {value}")
        return value.lower() == "true"

    def number(self, name: str, default: float) -> float:
        value = self.text(name)
        if value is None:
            return default
        try:
            return float(value)
        except ValueError:
            raise self.error(f"invalid float value for {name}: {value}") from None

    def is_wanted(self) -> bool:
        """What `if` and `unless` say; True without them."""
        condition, exception = self.text("if"), self.text("unless")
        if condition is not None and exception is not None:
            raise self.error("cannot set both 'if' and 'unless' on the same tag")
        try:
            if condition is not None:
                return convert_bool(condition)
            return exception is None or not convert_bool(exception)
        except ValueError as error:
            raise self.error(str(error)) from None

    def unknown(self, known: Iterable[str]) -> list[str]:
        """A warning for each attribute that this element does not have."""
        tag = self._element.tag
        surplus = self._element.attributes.keys() - set(known) - {"if", "unless"}
        return [f"[{self.place}] unknown <{tag}> attribute '{name}'" for name in sorted(surplus)]


def shown(element: Element) -> str:
    """The start tag of an element as one writes it, for messages."""
    attributes = "".join(f' {name}="{value}"' for name, value in element.attributes.items())
    end = ">" if element.children or element.text.strip() else "/>"
    written = f"<{element.tag}{attributes}{end}"
    return written if len(written) <= _SHOWN_CHARACTERS else written[:_SHOWN_CHARACTERS] + "…"
