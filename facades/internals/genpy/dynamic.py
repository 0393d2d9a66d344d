"""`genpy.dynamic`: message classes from the definition in a connection header or a bag."""

from genmsg import InvalidMsgSpec, MsgContext, MsgGenerationException, MsgNotFound
from pipros.basics.lazy_names import star_names as _star_names
from pipros.msg.base import Message
from pipros.msg.dynamic import message_classes_from_text
from pipros.msg.language.spec import DefinitionError, UnknownType

__all__ = ["MsgContext", "MsgGenerationException", "generate_dynamic"]

_star_names(__name__, "atexit genmsg os re shutil io:StringIO sys tempfile")


class _BrokenText(InvalidMsgSpec, MsgGenerationException):
    """An error that is both of the exceptions that programs catch."""


class _IncompleteText(MsgNotFound, MsgGenerationException):
    """As `_BrokenText`, for a type that the text lacks."""


def generate_dynamic(core_type: str, msg_cat: str) -> dict[str, type[Message]]:
    """Classes for `core_type` and all types that its full text embeds.

    Raises:
        MsgGenerationException: the text is broken; it is an `InvalidMsgSpec` as well, or `MsgNotFound` when
            a type is missing.
    """
    try:
        return message_classes_from_text(core_type, msg_cat)
    except UnknownType as error:
        raise _IncompleteText(str(error)) from error
    except DefinitionError as error:
        raise _BrokenText(str(error)) from error
