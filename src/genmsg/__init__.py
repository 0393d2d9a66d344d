"""`genmsg`, for those who import it. The code is in `pipros.msg`."""


class MsgGenerationException(Exception):
    """A definition cannot be made into a class."""


class InvalidMsgSpec(MsgGenerationException):
    """A definition breaks the rules of the language."""
