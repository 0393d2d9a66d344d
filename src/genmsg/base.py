"""`genmsg.base`: the constants of the definition language, and its errors."""

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
