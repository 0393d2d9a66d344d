"""`pipros plugins`: which plugins there are, how far their features are proven, and how to install them."""

from __future__ import annotations

import sys
from argparse import ArgumentParser
from collections.abc import Iterator, Sequence

from pipros.basics.extras import install_command
from pipros.basics.plugin_table import PLUGINS
from pipros.basics.plugins import plugins
from pipros_tools.cli.entry_point import command


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Print the installed plugins, then those of pipros that are not installed."""
    parser = ArgumentParser(prog="pipros plugins", description="List plugins and their features.")
    parser.parse_args(list(sys.argv[1:] if argv is None else argv))
    print("\n".join(lines()))
    return 0


def lines() -> Iterator[str]:
    """Yield the lines that `pipros plugins` prints."""
    installed = sorted(plugins(), key=lambda plugin: plugin.name)
    yield "Installed:"
    for plugin in installed:
        yield f"  {plugin.name:12}  {plugin.purpose}"
        for feature, status in plugin.features.items():
            yield f"  {'':12}    {status}: {feature}"
    absent = [name for name in sorted(PLUGINS) if name not in {plugin.name for plugin in installed}]
    if absent:
        yield "Not installed:"
    for name in absent:
        yield f"  {name:12}  {PLUGINS[name].purpose}: {install_command(PLUGINS[name].distribution)}"
