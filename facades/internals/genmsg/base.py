"""`genmsg.base`: the constants of the definition language, its errors, and what generators print."""

from pipros.basics.lazy_names import star_names as _star_names

_star_names(__name__, "inspect os pprint sys")

SEP = "/"
MSG_DIR = "msg"
SRV_DIR = "srv"
EXT_MSG = ".msg"
EXT_SRV = ".srv"
CONSTCHAR = "="
COMMENTCHAR = "#"
IODELIM = "---"


class InvalidMsgSpec(Exception):
    """A definition breaks the rules of the language."""


class MsgGenerationException(Exception):
    """A definition cannot be made into a class."""


verbose = False

_is_verbose = [verbose]


def log_verbose(value: bool) -> None:
    """Whether `log` and `plog` print from now on. They do not at first."""
    _is_verbose[0] = value


def log(*args: object) -> None:
    """Prints what a generator does, for those who asked by `log_verbose`."""
    if _is_verbose[0]:
        print("LOG:", *args)


def plog(msg: object, obj: object) -> None:
    """As `log`, of an object with a text in front."""
    if _is_verbose[0]:
        from pprint import pformat

        print("LOG:", msg, pformat(obj))
