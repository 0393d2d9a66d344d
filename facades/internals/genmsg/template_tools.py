"""`genmsg.template_tools`: made code of other languages from templates, which run as Python code.

pipros needs no generated code, and runs no templates: these functions exist, and raise an error that says so.
"""

from __future__ import annotations

from typing import NoReturn

from pipros.basics.lazy_names import star_names as _star_names

_star_names(__name__, "em errno genmsg os sys")


def generate_from_file(
    input_file: str,
    package_name: str,
    output_dir: str,
    template_dir: str,
    include_path: list[str],
    msg_template_dict: dict[str, str],
    srv_template_dict: dict[str, str],
) -> NoReturn:
    """Made code for a definition.

    Raises:
        NotImplementedError: always.
    """
    del output_dir, template_dir, include_path, msg_template_dict, srv_template_dict
    _refuse(f"code for {package_name}: {input_file}")


def generate_module(
    package_name: str, output_dir: str, template_dir: str, template_dict: dict[str, str]
) -> NoReturn:
    """Made code for a package; raises as `generate_from_file`."""
    del output_dir, template_dir, template_dict
    _refuse(f"code for {package_name}")


def generate_from_command_line_options(
    argv: list[str],
    msg_template_dict: dict[str, str],
    srv_template_dict: dict[str, str],
    module_template_dict: dict[str, str] | None = None,
) -> NoReturn:
    """Made the code that a command line asks for; raises as `generate_from_file`."""
    del msg_template_dict, srv_template_dict, module_template_dict
    _refuse(f"what {argv} asks for")


def _refuse(what: str) -> NoReturn:
    raise NotImplementedError(f"cannot make {what}: pipros has no templates. `catkin_make` makes C++ headers")
