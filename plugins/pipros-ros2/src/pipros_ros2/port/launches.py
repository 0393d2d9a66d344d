"""Drafts of launch files for ROS 2, in Python, and the values that launch files give to parameters."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pipros.basics.errors import PiprosError
from pipros.basics.words import split_words
from pipros.safe.yaml import YamlError
from pipros.safe.yaml import load as load_yaml
from pipros_tools.launch.load_context import LoadContext, NotRun
from pipros_tools.launch.model import NODE_SETTINGS, Launch, LaunchNode
from pipros_tools.launch.ros2_node import ros2_params, ros2_yaml
from pipros_tools.launch.xml import load

_IMPORTS = {
    "LaunchDescription(": "from launch import LaunchDescription",
    "Node(": "from launch_ros.actions import Node",
    "ParameterValue(": "from launch_ros.parameter_descriptions import ParameterValue",
    "Shutdown(": "from launch.actions import Shutdown",
    "share(": "from ament_index_python.packages import get_package_share_directory as share",
}
_NO_LITERALS = ("inf", "-inf", "nan")


class LaunchDrafts:
    """The launch files of a package, loaded with their defaults. No command in them is run.

    Attributes:
        files: the drafts, by the names of the files in ROS 2.
        left_out: the errors of files that cannot be loaded, by their names.
    """

    def __init__(self, folder: Path, package: str) -> None:
        self._package = package
        self._folders = {str(folder.resolve()): package}
        self._values: dict[tuple[str, str], list[Any]] = {}
        self._anonymous: list[str] = []
        self.files: dict[str, str] = {}
        self.left_out: dict[str, str] = {}
        own = LoadContext.of_process()

        def find(package: str, path: str) -> str:
            if package == self._package:
                return str(folder.resolve() / path)
            self._folders[own.find(package, "")] = package
            return own.find(package, path)

        def anonymous(name: str) -> str:
            self._anonymous.append(name)
            return name

        context = LoadContext(find, own.environment, anonymous, own.read_file, NotRun)
        for file in sorted(folder.rglob("*.launch")):
            name = str(file.relative_to(folder))
            self._anonymous.clear()
            try:
                launch = load([str(file)], context=context)
            except PiprosError as error:
                self.left_out[name] = str(error).partition("\n")[0]
                continue
            self.files[f"{name}.py"] = self._text(launch)

    def values(self, program: str) -> dict[str, Any]:
        """Return the parameters to which all launch files together give a program one value, by their names.

        Names of private parameters have no `~`, and dots; those of others start with a slash.
        """
        return {
            key: values[0]
            for (owner, key), values in self._values.items()
            if owner in ("", program) and all(each == values[0] for each in values)
            if type(values[0]) in (bool, int, float, str) and repr(values[0]) not in _NO_LITERALS
        }

    def _text(self, launch: Launch) -> str:
        body = "".join(f"    {_todo(each)}\n" for each in self._todos(launch))
        body += "    return LaunchDescription([\n"
        body += "".join(self._node(each, launch) for each in launch.nodes) + "    ])\n"
        imports = sorted(line for name, line in _IMPORTS.items() if name in body)
        return "\n".join(imports) + f"\n\n\ndef generate_launch_description():\n{body}"

    def _todos(self, launch: Launch) -> Iterator[str]:
        for argument in launch.arguments:
            if argument.value is None:
                yield f"the argument {argument.name} has its default {argument.default!r} here"
        for _, file in launch.includes:
            yield f"the nodes of {Path(file).name} are written here; IncludeLaunchDescription includes files"
        for name in self._anonymous:
            yield f"the name {name} was anonymous"
        for command in launch.commands:
            yield f"rosparam {command.action.value} {command.key} has no counterpart"
        private = tuple(f"{node.full_name}/" for node in launch.nodes)
        for key, value in launch.params.items():
            if not f"{key}/".startswith(private) and key != "/use_sim_time":
                yield f"[{key}] was on the parameter server; in ROS 2, a parameter belongs to one node"
                self._values.setdefault(("", key), []).append(value)

    def _node(self, node: LaunchNode, launch: Launch) -> str:
        lines = []
        if node.package != self._package:
            lines.append(_todo(f"is {node.package}/{node.type} in ROS 2, under these names?"))
        if node.machine or node.working_folder:
            lines.append(_todo("launch starts nodes here, in the folder where it was started"))
        params, words = [], ""
        try:
            words = ", ".join(map(self._part, split_words(node.arguments)))
        except ValueError as error:
            lines.append(_todo(f"arguments: {error}: {node.arguments}"))
        for key, value in ros2_params(node, launch.params):
            try:
                ros2_yaml(key, value)
            except ValueError as error:
                lines.append(_todo(str(error)))
                continue
            if isinstance(value, NotRun):
                lines.append(_todo(f"{key} is the output of a command: {value}"))
                continue
            if node.package == self._package:
                self._values.setdefault((node.type, key), []).append(value)
            params.append(f"{key!r}: {self._value(value)}")
        texts = {
            "namespace": repr(node.namespace.rstrip("/")),
            "arguments": f"[{words}]",
            "remappings": repr(list(node.remappings)),
            "additional_env": repr(dict(node.environment)),
            "output": repr(node.output.value if node.output else ""),
            "on_exit": "Shutdown()" if node.required else "''",
        }
        options = {
            each.ros2: texts.get(each.ros2, repr(getattr(node, each.field)))
            for each in NODE_SETTINGS
            if each.ros2
        }
        options["parameters"] = f"[{', '.join(params) and '{' + ', '.join(params) + '}'}]"
        empty = ("''", "[]", "{}", "False", "0.0")
        given = ", ".join(f"{key}={text}" for key, text in options.items() if text not in empty)
        return "".join(f"        {line}\n" for line in (*lines, f"Node({given}),"))

    def _value(self, value: Any) -> str:
        """Return the expression of a value. Launch reads texts as YAML, unless they have a type."""
        if isinstance(value, str):
            text = self._part(value)
            return text if _is_text(value) else f"ParameterValue({text}, value_type=str)"
        if isinstance(value, list):
            numbers = map(float, value) if float in map(type, value) else value
            return f"[{', '.join(self._part(each) for each in numbers)}]"
        return self._part(value)

    def _part(self, value: Any) -> str:
        for folder, package in self._folders.items():
            if f"{value}/".startswith(f"{folder}/"):
                return f"share({package!r}) + {value[len(folder) :]!r}"
        return f"float('{value}')" if repr(value) in _NO_LITERALS else repr(value)


def _todo(reason: str) -> str:
    return f"# TODO: {' '.join(reason.split())}"


def _is_text(text: str) -> bool:
    try:
        return bool(load_yaml(text, angles=False) == text)
    except YamlError:
        return False
