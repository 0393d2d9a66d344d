"""Reads the elements that change the scope of later elements: `<remap>`, `<env>` and `<arg>`."""

from __future__ import annotations

from collections.abc import Mapping

from pipros_tools.launch.model import Argument, LaunchError
from pipros_tools.launch.reader import ElementReader


def read_remap(reader: ElementReader) -> None:
    reader.allow("from", "to")
    source, target = reader.text("from"), reader.text("to")
    if source is None or target is None:
        raise reader.error("Invalid <remap> tag: <remap> tag is missing required from/to attributes")
    try:
        reader.scope.remap(source, target)
    except ValueError as error:
        raise reader.error(f"Invalid <remap> tag: {error}") from None


def read_env(reader: ElementReader) -> None:
    reader.allow("name", "value")
    name, value = reader.text("name"), reader.text("value")
    if name is None or value is None:
        raise reader.error("<env> tag is missing required name/value attributes")
    if not name:
        raise reader.error("Invalid <env> tag: 'name' attribute must be non-empty")
    if "=" in name or "\0" in name or "\0" in value:
        raise reader.error(f"Invalid <env> tag: [{name}] cannot be the name of an environment variable")
    reader.scope.environment.append((name, value))


def read_arg(reader: ElementReader) -> Argument:
    """Read an `<arg>`, declare the argument in the scope, and return it."""
    argument = _argument(reader)
    try:
        reader.scope.declare(argument)
    except ValueError as error:
        raise reader.error(f"Invalid <arg> tag: {error}.") from None
    return argument


def read_included_arguments(
    reader: ElementReader, passed: Mapping[str, str | None] | None
) -> dict[str, str | None]:
    """Return the values of the `<arg>`s inside an `<include>`, by name, and add its `<env>`s to the scope.

    `passed` is the arguments that `pass_all_args` passes; None without it. As in Noetic, an `<arg>` may only
    be repeated with `pass_all_args`, where a `default` does not replace a passed value.
    """
    given: dict[str, str | None] = {}
    for child in reader.children():
        if child.tag.lower() not in ("arg", "env"):
            child.warn(f"unrecognized '{child.tag}' tag in <include> tag in {child.place}")
        elif not child.is_wanted():
            continue
        elif child.tag.lower() == "env":
            read_env(child)
        else:
            name, default, value, _ = _argument(child)
            if name in given and passed is None:
                raise child.error(f"Invalid <arg> tag: arg '{name}' has already been declared.")
            if value is None:
                value = given.get(name, (passed or {}).get(name))
            value = default if value is None else value
            if value is None:
                raise child.error("include args must have declared values")
            given[name] = value
    return given


def _argument(reader: ElementReader) -> Argument:
    reader.allow("name", "value", "default", "doc")
    try:
        if reader.has("value") and reader.has("default"):
            raise reader.error("<arg> tag must have one and only one of value/default.")
        return Argument(
            reader.required("name"), reader.text("default"), reader.text("value"), reader.text("doc")
        )
    except LaunchError as error:
        # Without its cause: as in Noetic, an unset argument in an <arg> is never ignored.
        raise LaunchError(f"Invalid <arg> tag: {error.reason}", error.places, error.element) from None
