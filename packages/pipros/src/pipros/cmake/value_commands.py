"""The CMake commands that need only the current scope, keyed by name."""

from __future__ import annotations

from collections.abc import Mapping

from pipros.cmake import arithmetic, files, lists, paths, strings, variables
from pipros.cmake.configure import configure_file
from pipros.cmake.execute_process import execute_process
from pipros.cmake.scope import ValueCommand

VALUE_COMMANDS: Mapping[str, ValueCommand] = {
    "cmake_parse_arguments": variables.cmake_parse_arguments,
    "configure_file": configure_file,
    "execute_process": execute_process,
    "file": files.carry_out,
    "find_file": paths.find_file,
    "find_path": paths.find_path,
    "find_program": paths.find_program,
    "get_filename_component": paths.get_filename_component,
    "get_property": variables.get_property,
    "list": lists.carry_out,
    "math": arithmetic.math,
    "option": variables.option,
    "separate_arguments": strings.separate_arguments,
    "set": variables.set_variable,
    "set_property": variables.set_property,
    "string": strings.carry_out,
    "unset": variables.unset,
}
