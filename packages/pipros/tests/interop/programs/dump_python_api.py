"""Print the public names of Python packages as JSON: modules, functions with parameters, classes, constants.

Runs under genuine ROS's Python and under pipros', so it needs only the standard library.
Usage: dump_python_api.py PACKAGE…
"""

from __future__ import annotations

import ast
import contextlib
import functools
import importlib
import inspect
import json
import pkgutil
import sys
import types

ROS = {*sys.argv[1:]} - {"roswtf"}  # its rules are those of pipros
"""The packages of which classes are taken apart; what comes from elsewhere is no part of their API."""

PLAIN = (str, int, float, bool, type(None))


def described_parameters(function):
    """`[[name, kind, has_default, default], …]`, the default only if plain; None if unknown."""
    try:
        signature = inspect.signature(function)
    except (TypeError, ValueError):
        return None
    found = []
    for one in signature.parameters.values():
        has_default = one.default is not inspect.Parameter.empty
        default = one.default if has_default and isinstance(one.default, PLAIN) else None
        found.append([one.name, one.kind.name, has_default, default])
    return found


def is_message(thing):
    """Return whether it is the class of a message or service, generated from a definition."""
    return isinstance(thing, type) and hasattr(thing, "_md5sum") and hasattr(thing, "_type")


def is_ours(thing):
    """Return whether a class or function was written by hand in a package of ROS, or in pipros for it."""
    package = str(getattr(thing, "__module__", "")).partition(".")[0]
    return not is_message(thing) and (package in ROS or package.partition("_")[0] == "pipros")


@functools.cache
def class_definitions(module):
    """Return the syntax trees of a module's classes by qualified name; empty without a source."""
    found = {}

    def add(node, prefix):
        for one in node.body:
            if isinstance(one, ast.ClassDef):
                found[prefix + one.name] = one
                add(one, f"{prefix}{one.name}.")

    with contextlib.suppress(OSError, TypeError, KeyError):
        add(ast.parse(inspect.getsource(sys.modules[module])), "")
    return found


@functools.cache
def attributes_set(cls):
    """Public names that methods of the class assign to `self`, and those of its annotations."""
    found = set()
    for base in cls.__mro__:
        if not is_ours(base):
            continue
        found |= {name for name in getattr(base, "__annotations__", {}) if not name.startswith("_")}
        tree = class_definitions(base.__module__).get(base.__qualname__)
        if tree is None:
            continue
        for node in ast.walk(tree):
            if (
                isinstance(node, ast.Attribute)
                and isinstance(node.ctx, ast.Store)
                and isinstance(node.value, ast.Name)
                and node.value.id == "self"
                and not node.attr.startswith("_")
            ):
                found.add(node.attr)
    return sorted(found)


def described_class(cls):
    members = {}
    for name in dir(cls):
        if name.startswith("_"):
            continue
        if not any(name in vars(base) for base in cls.__mro__ if is_ours(base)):
            members[name] = {"kind": "inherited"}  # from the standard library
            continue
        value = inspect.getattr_static(cls, name)
        if isinstance(value, (staticmethod, classmethod)) or inspect.isfunction(value):
            members[name] = {"kind": "method", "parameters": described_parameters(getattr(cls, name))}
        else:
            members[name] = {"kind": "attribute"}
    for name in attributes_set(cls):
        members.setdefault(name, {"kind": "attribute"})
    return {
        "kind": "class", "parameters": described_parameters(cls),
        "bases": [base.__name__ for base in cls.__mro__[:-1]], "members": members,
    }  # fmt: skip


def described(value):
    """Describe the object of a name in a module; None if it is not part of the API."""
    if isinstance(value, types.ModuleType) or type(value).__name__ == "_Feature":
        return None
    if is_message(value):
        return {"kind": "message"}
    if isinstance(value, type):
        return described_class(value) if is_ours(value) else {"kind": "class", "foreign": True}
    if callable(value):
        made = {"kind": "function", "parameters": described_parameters(value)}
        return made if is_ours(value) else {**made, "foreign": True}
    if isinstance(value, PLAIN):
        return {"kind": "constant", "value": value}
    if isinstance(value, (list, tuple)) and all(isinstance(item, PLAIN) for item in value):
        return {"kind": "constant", "value": list(value)}
    if type(value).__module__ == "typing":
        return None
    return {"kind": "constant"}


MADE = {"msg", "srv", "cfg"}
"""Modules that are made of definitions, which other tests compare."""


def is_public(module):
    parts = module.split(".")
    return not MADE & set(parts) and not any(part.startswith("_") for part in parts)


def dumped(package):
    """Return every public module of the package that was written by hand, with its public names."""
    modules, failed = {}, {}
    root = importlib.import_module(package)
    names = [package]
    names += [
        found.name for found in pkgutil.walk_packages(root.__path__, package + ".", onerror=lambda _: None)
    ]
    for name in filter(is_public, names):
        try:
            module = importlib.import_module(name)
        except Exception as error:
            failed[name] = repr(error)
            continue
        # Names that only a star import binds here are in `__all__`, not in `dir`.
        public = [one for one in {*dir(module), *getattr(module, "__all__", ())} if not one.startswith("_")]
        listed = {one: described(getattr(module, one)) for one in public}
        modules[name] = {one: what for one, what in listed.items() if what is not None}
    return modules, failed


def main():
    modules, failed = {}, {}
    for package in sys.argv[1:]:
        try:
            found, broken = dumped(package)
        except ImportError as error:
            failed[package] = repr(error)
            continue
        modules.update(found)
        failed.update(broken)
    json.dump({"modules": modules, "failed": failed}, sys.stdout, default=repr)


if __name__ == "__main__":
    main()
