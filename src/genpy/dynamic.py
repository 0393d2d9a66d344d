"""`genpy.dynamic`: message classes from the text in a connection header or a bag."""

from genmsg import MsgGenerationException
from pipros.msg.base import Message
from pipros.msg.dynamic import message_classes_from_text
from pipros.msg.spec import DefinitionError

__all__ = ["MsgGenerationException", "generate_dynamic"]


def generate_dynamic(core_type: str, msg_cat: str) -> dict[str, type[Message]]:
    """Classes for `core_type` and all types that its full text embeds.

    Raises:
        MsgGenerationException: when the text is broken.
    """
    try:
        return message_classes_from_text(core_type, msg_cat)
    except DefinitionError as error:
        raise MsgGenerationException(str(error)) from error
