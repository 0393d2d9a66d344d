"""Reads an element of a launch file: its attributes, with substitutions applied, and its scope."""

from __future__ import annotations

from collections.abc import Iterator
from enum import Enum
from typing import NamedTuple, TypeVar

from pipros.safe.xml import Element
from pipros_tools.launch.builder import LaunchBuilder
from pipros_tools.launch.load_context import LoadContext
from pipros_tools.launch.model import LaunchError, Place
from pipros_tools.launch.param_types import convert_bool
from pipros_tools.launch.scope import LaunchScope
from pipros_tools.launch.substitute import UnsetArgument

_SHOWN_CHARACTERS = 200

_Choice = TypeVar("_Choice", bound=Enum)


class ElementReader(NamedTuple):
    """An element and everything needed to read it. All errors name the element and its location.

    Attributes:
        element: the element as written.
        scope: the scope that the element inherits, and may change for later elements.
        builder: collects the element's contents.
        context: access to this computer's packages, files and commands.
    """

    element: Element
    scope: LaunchScope
    builder: LaunchBuilder
    context: LoadContext

    @property
    def place(self) -> Place:
        return Place(self.scope.file, self.element.line, self.element.column)

    @property
    def tag(self) -> str:
        return self.element.tag

    def inside(self, scope: LaunchScope) -> ElementReader:
        """Return a reader for the same element in another scope."""
        return ElementReader(self.element, scope, self.builder, self.context)

    def children(self) -> Iterator[ElementReader]:
        """Yield the child elements, in the same scope."""
        for child in self.element.children:
            yield ElementReader(child, self.scope, self.builder, self.context)

    # ---- attributes

    def has(self, name: str) -> bool:
        """Return whether the element has the attribute."""
        return name in self.element.attributes

    def text(self, name: str) -> str | None:
        """Return the attribute after substitution, or None if the element lacks it."""
        written = self.element.attributes.get(name)
        return None if written is None else self.resolve(written)

    def required(self, name: str) -> str:
        value = self.text(name)
        if value is None:
            raise self.error(f"<{self.tag}> tag is missing required attribute: '{name}'")
        return value

    def flag(self, name: str, *, default: bool = False) -> bool:
        """Return the attribute as a bool; it must be `true` or `false`, ignoring case."""
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

    def positive(self, name: str, default: float) -> float:
        """Return the attribute, which must be a number greater than zero."""
        text = self.text(name)
        try:
            number = default if text is None else float(text)
        except ValueError:
            raise self.error(f"'{name}' must be a number: [{text}]") from None
        if not number > 0:
            raise self.error(f"'{name}' must be a positive number: [{number}]")
        return number

    def whole_number(self, name: str, default: int) -> int:
        text = self.text(name)
        try:
            return int(text or default)
        except ValueError:
            raise self.error(f"'{name}' must be a number: [{text}]") from None

    def choice(self, name: str, kind: type[_Choice]) -> _Choice | None:
        """Return the attribute `name` as a member of `kind`, or None if the element lacks the attribute."""
        text = self.text(name)
        if text is None:
            return None
        try:
            return kind(text)
        except ValueError:
            allowed = ", ".join(f"'{choice.value}'" for choice in kind)
            raise self.error(f"{name} must be one of {allowed}") from None

    def is_wanted(self) -> bool:
        """Return whether the element applies, according to its `if` or `unless`; True if it has neither."""
        condition, exception = self.text("if"), self.text("unless")
        if condition is not None and exception is not None:
            raise self.error("cannot set both 'if' and 'unless' on the same tag")
        try:
            if condition is not None:
                return convert_bool(condition)
            return exception is None or not convert_bool(exception)
        except ValueError as error:
            raise self.error(str(error)) from None

    def resolve(self, written: str) -> str:
        """Return a string from this element with all substitutions applied."""
        try:
            return self.scope.substitution.resolve(written)
        except UnsetArgument as error:
            raise self.error(f"[{self.scope.file}] {error}") from error
        except (ValueError, LookupError) as error:
            raise self.error(str(error)) from error

    # ---- namespaces, warnings, errors

    def open_namespace(self) -> LaunchScope:
        """Return the scope for the children, extended by this element's `ns`."""
        namespace = self.text("ns")
        if namespace == "":
            raise self.error(f"<{self.tag}> tag has an empty 'ns' attribute")
        try:
            return self.scope.child(namespace or "")
        except ValueError as error:
            raise self.error(str(error)) from None

    def allow(self, *known: str) -> None:
        """Warn about all attributes other than `known`, `if` and `unless`."""
        surplus = self.element.attributes.keys() - {*known, "if", "unless"}
        self.warn(*(f"[{self.place}] unknown <{self.tag}> attribute '{name}'" for name in sorted(surplus)))

    def warn(self, *warnings: str) -> None:
        self.builder.warn(*warnings)

    def error(self, reason: str) -> LaunchError:
        return LaunchError(reason, [self.place], shown(self.element))


def shown(element: Element) -> str:
    """Return the start tag of an element, for messages. A long tag is truncated."""
    attributes = "".join(f' {name}="{value}"' for name, value in element.attributes.items())
    end = ">" if element.children or element.text.strip() else "/>"
    written = f"<{element.tag}{attributes}{end}"
    return written if len(written) <= _SHOWN_CHARACTERS else written[:_SHOWN_CHARACTERS] + "…"
