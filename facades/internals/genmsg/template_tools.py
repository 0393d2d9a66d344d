"""`genmsg.template_tools`, which in Noetic generates code in other languages from EmPy templates.

pipros does not support templates, so these functions only raise NotImplementedError.
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
    """Raise NotImplementedError, because code generation for a definition is not supported.

    Raises:
        NotImplementedError: always.
    """
    del output_dir, template_dir, include_path, msg_template_dict, srv_template_dict
    _refuse(f"code for {package_name}: {input_file}")


def generate_module(
    package_name: str, output_dir: str, template_dir: str, template_dict: dict[str, str]
) -> NoReturn:
    """Raise NotImplementedError, because code generation for a package is not supported."""
    del output_dir, template_dir, template_dict
    _refuse(f"code for {package_name}")


def generate_from_command_line_options(
    argv: list[str],
    msg_template_dict: dict[str, str],
    srv_template_dict: dict[str, str],
    module_template_dict: dict[str, str] | None = None,
) -> NoReturn:
    """Raise NotImplementedError, because code generation from command-line options is not supported."""
    del msg_template_dict, srv_template_dict, module_template_dict
    _refuse(f"code for the arguments {argv}")


def _refuse(what: str) -> NoReturn:
    raise NotImplementedError(
        f"cannot generate {what}: pipros does not support templates. `catkin_make` generates C++ headers"
    )
