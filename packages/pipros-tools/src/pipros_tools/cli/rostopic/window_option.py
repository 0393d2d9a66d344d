"""The option `--window` for `rostopic hz` and `rostopic bw`."""

from __future__ import annotations

from optparse import OptionParser, Values


def add_window_option(parser: OptionParser) -> None:
    parser.add_option(
        "-w",
        "--window",
        dest="window",
        metavar="WINDOW",
        help="window size, in # of messages, for calculating rate",
    )


def window_of(parser: OptionParser, options: Values, default: int) -> int:
    """Return the window size, in messages; the default if it is not positive.

    Exit with an error if it is not an integer.
    """
    try:
        window = 0 if options.window is None else int(options.window)
    except ValueError:
        parser.error("window size must be an integer")
    return window if window > 0 else default
