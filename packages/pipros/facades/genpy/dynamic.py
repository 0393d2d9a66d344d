"""`genpy.dynamic`: creates message classes from the definitions in connection headers and bags."""

from genmsg import InvalidMsgSpec, MsgContext, MsgGenerationException, MsgNotFound
from pipros.msg.base import Message
from pipros.msg.dynamic import message_classes_from_text
from pipros.msg.language.spec import DefinitionError, UnknownType

__all__ = ["MsgContext", "MsgGenerationException", "generate_dynamic"]


class _BrokenText(InvalidMsgSpec, MsgGenerationException):
    """The text is invalid. Derived from both exceptions because some programs catch only one of them."""


class _IncompleteText(MsgNotFound, MsgGenerationException):
    """The text lacks an embedded type. Derived from both exceptions; see `_BrokenText`."""


def generate_dynamic(core_type: str, msg_cat: str) -> dict[str, type[Message]]:
    """Return the classes of `core_type` and all types embedded in its full text, keyed by type name.

    Raises:
        MsgGenerationException: the text is invalid. The exception is also an `InvalidMsgSpec`, or a
            `MsgNotFound` if a type is missing.
    """
    try:
        return message_classes_from_text(core_type, msg_cat)
    except UnknownType as error:
        raise _IncompleteText(str(error)) from error
    except DefinitionError as error:
        raise _BrokenText(str(error)) from error
