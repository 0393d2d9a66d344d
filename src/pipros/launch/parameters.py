"""Reads `<param>` and `<rosparam>`."""

from __future__ import annotations

from typing import Any

from pipros.launch.attributes import Attributes
from pipros.launch.draft import Draft
from pipros.launch.model import LaunchError, ParameterAction, ParameterCommand
from pipros.launch.scope import Scope
from pipros.launch.surroundings import Surroundings
from pipros.launch.values import convert, flatten
from pipros.safe.xml import Element

_PARAM_SOURCES = ("value", "textfile", "binfile", "command")


def read_param(element: Element, scope: Scope, draft: Draft, surroundings: Surroundings) -> tuple[str, Any]:
    """The name, as it is written, and the value of a `<param>`."""
    attributes = Attributes(element, scope)
    draft.warn(*attributes.unknown(("name", "type", *_PARAM_SOURCES)))
    given = [source for source in _PARAM_SOURCES if source in element.attributes]
    if len(given) != 1:
        raise attributes.error("<param> tag must have one and only one of value/textfile/binfile/command.")
    name = attributes.required("name").strip()
    content = attributes.text(given[0]) or ""
    type_name = attributes.text("type") or ""
    try:
        if given[0] == "binfile":
            return name, surroundings.read_file(content)
        if given[0] == "textfile":
            return name, convert(surroundings.read_file(content).decode(), type_name, content)
        if given[0] == "command":
            return name, convert(_run(scope.resolve_param(name), content, surroundings), type_name, content)
        return name, convert(content.strip(), type_name)
    except OSError as error:
        raise attributes.error(f"Invalid <param> tag: cannot read [{content}]: {error.strerror}") from None
    except ValueError as error:
        raise attributes.error(f"Invalid <param> tag: {error}.") from error


def _run(key: str, command: str, surroundings: Surroundings) -> str:
    try:
        return surroundings.run_command(command)
    except ValueError as error:
        raise ValueError(f"Cannot load command parameter [{key}]: {error}") from error


def read_rosparam(element: Element, scope: Scope, draft: Draft, surroundings: Surroundings) -> dict[str, Any]:
    """The parameters that a `<rosparam>` loads, by name; those that it dumps or deletes go to the draft."""
    attributes = Attributes(element, scope)
    draft.warn(*attributes.unknown(("command", "file", "param", "ns", "subst_value")))
    command = attributes.text("command") or "load"
    file = attributes.text("file")
    if command not in ("load", "dump", "delete"):
        raise _error(attributes, "command must be 'load', 'dump', or 'delete'")
    try:
        inner = scope.child(attributes.text("ns") or "")
    except ValueError as error:
        raise _error(attributes, str(error)) from None
    param = attributes.text("param")
    if command != "load":
        if command == "delete" and file is not None:
            raise _error(attributes, "'file' attribute is invalid with 'delete' command.")
        key = inner.resolve_param(param) if param else inner.namespace
        draft.add_command(ParameterCommand(ParameterAction(command), key, file or ""))
        return {}
    return _load(attributes, element, inner, param, file, surroundings)


def _load(
    attributes: Attributes,
    element: Element,
    scope: Scope,
    param: str | None,
    file: str | None,
    surroundings: Surroundings,
) -> dict[str, Any]:
    from pipros.safe import yaml  # costs 10 ms, and not every launch file needs it

    # Blank lines in front make the line numbers of YAML errors those of the launch file.
    text, source = "\n" * (element.line - 1) + element.text, scope.file
    if file is not None:
        source = file
        try:
            text = surroundings.read_file(file).decode()
        except FileNotFoundError:
            raise _error(attributes, f"file does not exist [{file}]") from None
        except (OSError, UnicodeDecodeError) as error:
            raise _error(attributes, f"cannot read [{file}]: {error}") from None
    if attributes.flag("subst_value"):
        text = attributes.resolve(text)
    if not text.strip():
        return {}
    try:
        value = yaml.load(text, source)
        if value is None:
            return {}
        if not isinstance(value, dict) and not param:
            raise _error(attributes, "'param' attribute must be set for non-dictionary values")
        if param:
            return flatten(scope.resolve_param(param), value)
        return {scope.resolve_param(key.lstrip("/")): leaf for key, leaf in flatten("", value).items()}
    except yaml.YamlError as error:
        where = f"file {file} contains invalid YAML" if file else "invalid YAML"
        raise _error(attributes, f"{where}:\n{error}") from None
    except ValueError as error:
        raise _error(attributes, str(error)) from None


def _error(attributes: Attributes, reason: str) -> LaunchError:
    return attributes.error(f"error loading <rosparam> tag: \n\t{reason}")
