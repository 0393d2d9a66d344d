"""`genmsg.base`: the marks of the definition language, and what goes wrong with it."""

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
