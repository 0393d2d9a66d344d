"""`genmsg.names`: names of the form package/Name."""

from __future__ import annotations

import re

PRN_SEPARATOR = "/"

RESOURCE_NAME_LEGAL_CHARS_P = re.compile(r"^[A-Za-z][\w/]*$", re.ASCII)
BASE_RESOURCE_NAME_LEGAL_CHARS_P = re.compile(r"^[A-Za-z]\w*$", re.ASCII)

_LEGAL = re.compile(r"[A-Za-z][\w/]*", re.ASCII)
_LEGAL_BASE = re.compile(r"[A-Za-z]\w*", re.ASCII)


def is_legal_resource_name(name: str | None) -> bool:
    """Return True for a valid name, with or without a package."""
    return name is not None and _LEGAL.fullmatch(name) is not None and "//" not in name


def is_legal_resource_base_name(name: str | None) -> bool:
    """Return True for a valid name without a package."""
    return name is not None and _LEGAL_BASE.fullmatch(name) is not None


def package_resource_name(name: str) -> tuple[str, str]:
    """Split a name into a package and a base name. The package is empty if the name does not contain one.

    Raises:
        ValueError: the name contains more than one separator.
    """
    package, _, base = name.rpartition(PRN_SEPARATOR)
    if PRN_SEPARATOR in package:
        raise ValueError(f"invalid name [{name}]")
    return package, base


def resource_name(res_pkg_name: str, name: str, my_pkg: str | None = None) -> str:
    """Return `package/name`, or only the name if the package is `my_pkg`."""
    if res_pkg_name == my_pkg:
        return name
    return f"{res_pkg_name}{PRN_SEPARATOR}{name}"


def resource_name_base(name: str) -> str:
    return name.rpartition(PRN_SEPARATOR)[2]


def resource_name_package(name: str) -> str | None:
    return name.partition(PRN_SEPARATOR)[0] if PRN_SEPARATOR in name else None


def normalize_package_context(package_context: str) -> str:
    """Return the package without surrounding whitespace and trailing slashes."""
    return package_context.strip().rstrip(PRN_SEPARATOR)
