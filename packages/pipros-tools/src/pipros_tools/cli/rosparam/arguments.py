"""Options and arguments shared by several `rosparam` subcommands."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from pipros_tools.cli.runner import add_flag, single_argument

if TYPE_CHECKING:
    from optparse import OptionParser, Values


def add_verbose_option(parser: OptionParser) -> None:
    add_flag(parser, "-v", dest="verbose", help="turn on verbose output")


def parse_name(parser: OptionParser, argv: Sequence[str]) -> tuple[Values, str]:
    """Return the options and the single parameter name."""
    options, arguments = parser.parse_args(list(argv))
    return options, single_argument(
        parser,
        arguments,
        missing="invalid arguments. Please specify a parameter name",
        several="too many arguments",
    )
