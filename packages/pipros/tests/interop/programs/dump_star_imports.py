"""Print as JSON the names that star imports bind, for each module of the given packages.

Each name is listed with the origin of its value, `{name: [module, name there]}`. Each package is examined in
its own process, the package itself first, because submodules imported by others would be bound, too.
Runs under genuine ROS's Python and under pipros', so it needs only the standard library.
Usage: dump_star_imports.py NAME…, packages or modules such as `std_msgs.msg`
"""

import contextlib
import importlib
import json
import os
import pkgutil
import sys
import types

LIBRARIES = (
    "argparse email.parser http.server logging.config multiprocessing numpy unittest xmlrpc.client yaml"
)
for library in LIBRARIES.split():  # of no package of ROS: each fork would import them again
    importlib.import_module(library)


def modules_of(name):
    """Return the package and its public handwritten modules, without those generated from definitions."""
    yield name
    for _, found, is_package in pkgutil.iter_modules(getattr(sys.modules[name], "__path__", ())):
        module = f"{name}.{found}"
        if found.startswith("_") or found in {"msg", "srv", "cfg"}:
            continue
        if not is_package:
            yield module
        else:
            with contextlib.suppress(Exception):
                importlib.import_module(module)
                yield from modules_of(module)


def origin(name, value):
    """Return the origin of a value as `[module, name]`, or a plain value itself."""
    if isinstance(value, types.ModuleType):
        return [value.__name__, ""]
    if isinstance(value, type) or callable(value):
        return [str(getattr(value, "__module__", "?")), getattr(value, "__qualname__", name)]
    return [f"value of {type(value).__module__}", type(value).__name__]


def star_imported(name):
    namespace = {}
    try:
        exec(f"from {name} import *", namespace)  # noqa: S102
    except Exception as error:
        return repr(error)
    del namespace["__builtins__"]
    return {key: origin(key, value) for key, value in namespace.items()}


def examined(package):
    found = {package: star_imported(package)}
    if package in sys.modules:
        for name in modules_of(package):
            found.setdefault(name, star_imported(name))
    return found


def examined_in_a_process_of_its_own(package):
    reading, writing = os.pipe()
    if child := os.fork():
        os.close(writing)
        with open(reading, encoding="utf-8") as pipe:
            answer = json.load(pipe)
        os.waitpid(child, 0)
        return answer
    os.close(reading)
    with open(os.devnull, "w") as nothing, contextlib.redirect_stdout(nothing):
        found = examined(package)
    with open(writing, "w", encoding="utf-8") as pipe:
        json.dump(found, pipe)
    os._exit(0)


found = {}
for argument in sys.argv[1:]:
    found.update(examined_in_a_process_of_its_own(argument))
json.dump(found, sys.stdout)
