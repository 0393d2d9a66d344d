"""Read the `<param>` and `<rosparam>` elements of launch files."""

from __future__ import annotations

from typing import Any

from pipros.basics import names
from pipros_tools.launch.load_context import NotRun
from pipros_tools.launch.model import LaunchError, ParameterAction, ParameterCommand
from pipros_tools.launch.param_types import convert, parameters_in
from pipros_tools.launch.reader import ElementReader

_PARAM_SOURCES = ("value", "textfile", "binfile", "command")


def read_param(reader: ElementReader) -> tuple[str, Any]:
    """Return the name, as written, and the value of a `<param>`."""
    reader.allow("name", "type", *_PARAM_SOURCES)
    given = [source for source in _PARAM_SOURCES if reader.has(source)]
    if len(given) != 1:
        raise reader.error("<param> tag must have one and only one of value/textfile/binfile/command.")
    name = reader.required("name").strip()
    content = reader.text(given[0]) or ""
    type_name = reader.text("type") or ""
    try:
        if given[0] == "binfile":
            return name, reader.context.read_file(content)
        if given[0] == "textfile":
            return name, convert(reader.context.read_file(content).decode(), type_name, content)
        if given[0] == "command":
            output = _run(reader, name, content)
            return name, output if isinstance(output, NotRun) else convert(output, type_name, content)
        return name, convert(content.strip(), type_name)
    except OSError as error:
        raise reader.error(f"Invalid <param> tag: cannot read [{content}]: {error.strerror}") from None
    except ValueError as error:
        raise reader.error(f"Invalid <param> tag: {error}.") from error


def _run(reader: ElementReader, name: str, command: str) -> str:
    try:
        return reader.context.run_command(command)
    except ValueError as error:
        key = reader.scope.resolve_param(name)
        raise ValueError(f"Cannot load command parameter [{key}]: {error}") from error


def read_rosparam(reader: ElementReader, *, is_in_node: bool = False) -> dict[str, Any]:
    """Return the parameters that a `<rosparam>` loads, by name.

    If the element dumps or deletes parameters, add that command to the launch. A name that starts with `~`
    is private to the node in which the element is, or to each later node. This differs from Noetic, which
    sets a parameter with a tilde in its name, which no node can read.
    """
    reader.allow("command", "file", "param", "ns", "subst_value")
    has_substitutions = reader.flag("subst_value")
    command = reader.text("command") or "load"
    file = reader.text("file")
    if command not in ("load", "dump", "delete"):
        raise _error(reader, "command must be 'load', 'dump', or 'delete'")
    # As in Noetic, `ns` is the first part of the name, even if `param` is empty.
    param = names.canonicalize(names.join(reader.text("ns") or "", reader.text("param") or ""))
    if command != "load":
        if command == "delete" and file is not None:
            raise _error(reader, "'file' attribute is invalid with 'delete' command.")
        key = reader.scope.resolve_param(param)
        if is_in_node:
            key = reader.scope.resolve_private(key)
        if not reader.text("param"):
            try:
                key = names.make_global_namespace(key)
            except ValueError as error:
                raise _error(reader, str(error)) from None
        reader.builder.add_command(ParameterCommand(ParameterAction(command), key, file or ""))
        return {}
    return _load(reader, param, file, has_substitutions=has_substitutions)


def _load(reader: ElementReader, param: str, file: str | None, *, has_substitutions: bool) -> dict[str, Any]:
    # imported here, because the import takes 10 ms and few launch files need it
    from pipros.safe.yaml import YamlError

    # Blank lines before the text make YAML errors report line numbers in the launch file.
    text, source = "\n" * (reader.element.line - 1) + reader.element.text, reader.scope.file
    if file is not None:
        source = file
        try:
            text = reader.context.read_file(file).decode()
        except FileNotFoundError:
            raise _error(reader, f"file does not exist [{file}]") from None
        except OSError as error:
            raise _error(reader, f"cannot read [{file}]: {error.strerror or error}") from None
        except ValueError as error:  # not UTF-8, or over the launch's budget
            raise _error(reader, f"cannot read [{file}]: {error}") from None
    if has_substitutions:
        text = reader.resolve(text)
    if not text.strip():
        return {}
    try:
        scope = reader.scope
        key = scope.resolve_param(param) if param else ""
        found = parameters_in(text, source, key, is_named=bool(param.strip("/")))
        if param:
            return found
        return {scope.resolve_param(key): leaf for key, leaf in found.items()}
    except YamlError as error:
        where = f"file {file} contains invalid YAML" if file else "invalid YAML"
        raise _error(reader, f"{where}:\n{error}") from None
    except ValueError as error:
        raise _error(reader, str(error)) from None


def _error(reader: ElementReader, reason: str) -> LaunchError:
    return reader.error(f"error loading <rosparam> tag: \n\t{reason}")
