"""`genmsg.base`: constants and errors of the definition language, and log output for code generators."""

SEP = "/"
MSG_DIR = "msg"
SRV_DIR = "srv"
EXT_MSG = ".msg"
EXT_SRV = ".srv"
CONSTCHAR = "="
COMMENTCHAR = "#"
IODELIM = "---"


class InvalidMsgSpec(Exception):
    """A definition violates the rules of the language."""


class MsgGenerationException(Exception):
    """No class can be generated from a definition."""


verbose = False

_is_verbose = [verbose]


def log_verbose(value: bool) -> None:
    """Set whether `log` and `plog` print. They are silent by default."""
    _is_verbose[0] = value


def log(*args: object) -> None:
    """Print a log message from a generator if enabled by `log_verbose`."""
    if _is_verbose[0]:
        print("LOG:", *args)


def plog(msg: object, obj: object) -> None:
    """Print `msg` and an object if enabled by `log_verbose`."""
    if _is_verbose[0]:
        from pprint import pformat

        print("LOG:", msg, pformat(obj))
