"""Plugins: parts of pipros that can be left out of an installation, and how they extend the other parts.

A plugin is a top-level package `pipros_NAME` with a module `plugin.py`, which defines `PLUGIN`, a `Plugin`.
pipros's own plugins and those of others are found in the same way, by this name. A distribution that needs
another name adds an entry point in the group `pipros.plugins`, which names a `Plugin`. Other code finds
plugins only through `plugins()`, and never by name.

A declaration contains only data. An object that it names as `module:name` is imported when it is used.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import cache, partial
from importlib import import_module
from typing import Any, NamedTuple

from pipros.basics.plugin_folders import plugin_folders

__all__ = ["BETA", "EXPERIMENTAL", "STABLE", "Plugin", "PluginCommand"]

ENTRY_POINTS = "pipros.plugins"


class PluginCommand(NamedTuple):
    """A program, or a subcommand of `pipros`.

    Attributes:
        target: the function that runs the command, as `module:function`.
        purpose: a one-line description for lists of commands.
        heading: the heading in `pipros --help` under which the command is listed.
        subcommands: the command's subcommands, separated by spaces, for completion.
    """

    target: str
    purpose: str
    heading: str
    subcommands: str = ""


STABLE, BETA, EXPERIMENTAL = "stable", "beta", "experimental"
"""How far a feature is proven; docs/guides/plugins.md has the rule."""


class Plugin(NamedTuple):
    """The declaration of a plugin.

    ROS packages below the folder `share` of a plugin's package are found like those that pipros ships.

    Attributes:
        name: a short name, for texts.
        purpose: the plugin's purpose, in a few words.
        programs: the programs that it adds, by name. Its distribution, or pipros, installs them.
        subcommands: the subcommands that it adds to `pipros`, by name.
        verbs: the subcommands that it adds to other programs, by program and name. Their targets take the
            arguments and return the exit code.
        limits: the NamedTuple class of its limits, as `module:name`; empty if it has none.
        check: a `PluginCheck` of `pipros_tools.health` for `pipros doctor`, as `module:name`; empty if it
            has none.
        offers: modules and objects that other parts use if the plugin is installed, by the names that these
            parts pass to `offered`.
        nodelets: the classes of its nodelets, as `module:name`, by plugin name.
        features: `STABLE`, `BETA` or `EXPERIMENTAL` for each of its features, by name.
    """

    name: str
    purpose: str
    programs: Mapping[str, PluginCommand] = {}
    subcommands: Mapping[str, PluginCommand] = {}
    verbs: Mapping[str, Mapping[str, PluginCommand]] = {}
    limits: str = ""
    check: str = ""
    offers: Mapping[str, str] = {}
    nodelets: Mapping[str, str] = {}
    features: Mapping[str, str] = {}


def plugins() -> Iterator[Plugin]:
    """Yield the installed plugins: those with the usual names, then those of entry points.

    Entry points are read only when the iteration reaches them, because this takes longer than most commands.
    """
    yield from named_plugins()
    yield from _plugins_of_entry_points()


def verbs(program: str) -> dict[str, PluginCommand]:
    """Return the subcommands that installed plugins add to a program, by name."""
    return {name: each for plugin in plugins() for name, each in plugin.verbs.get(program, {}).items()}


def loaded(target: str) -> Any:
    """Import and return a module, or the object named by `module:name`."""
    module, _, name = target.partition(":")
    found = import_module(module)
    return getattr(found, name) if name else found


def offered(name: str) -> Any:
    """Return the object that an installed plugin offers under a name, or None if no plugin offers it."""
    target = next((plugin.offers[name] for plugin in plugins() if name in plugin.offers), None)
    return None if target is None else loaded(target)


def all_offered(name: str) -> list[Any]:
    """Return the objects that all installed plugins offer under a name."""
    return all_loaded(lambda plugin: plugin.offers.get(name, ""))


def all_loaded(target_of: Callable[[Plugin], str]) -> list[Any]:
    """Load the targets of all installed plugins that have one.

    A target that cannot be loaded is left out, with an error in the log.
    """
    found = []
    for plugin in plugins():
        if target := target_of(plugin):
            found += _unless_broken(f"{target} of the plugin {plugin.name}", partial(loaded, target))
    return found


def _unless_broken(what: str, load: Callable[[], Any]) -> list[Any]:
    """Return what `load` returns as a list, or an empty list after an error in the log."""
    try:
        return [load()]
    except (Exception, SystemExit) as error:  # any code of another distribution may run
        _report(f"{what} is left out: {type(error).__name__}: {error}")
        return []


def _report(text: str) -> None:
    import logging  # most commands do not need it

    logging.getLogger("pipros.plugins").error("%s", text)


@cache
def named_plugins() -> tuple[Plugin, ...]:
    """Return the installed plugins with the usual names, sorted by package name."""
    return tuple(
        each
        for package in plugin_folders()
        for each in _declared(f"{package}.plugin", partial(loaded, f"{package}.plugin:PLUGIN"))
    )


@cache
def _plugins_of_entry_points() -> tuple[Plugin, ...]:
    from importlib.metadata import entry_points

    return tuple(
        each
        for point in entry_points(group=ENTRY_POINTS)
        for each in _declared(
            f"the entry point {point.name} = {point.value} in the group {ENTRY_POINTS}", point.load
        )
    )


def _declared(where: str, load: Callable[[], Any]) -> Iterator[Plugin]:
    for each in _unless_broken(where, load):
        if isinstance(each, Plugin):
            yield each
        else:
            _report(f"{where} is left out: it must name a Plugin, got {type(each).__name__}")
