"""Any definition file becomes a working class, or raises DefinitionError.

python -m tests.fuzz.definitions --seconds 60
"""

import io
import sys
from contextlib import suppress
from typing import Any

from pipros.basics.limits import Limits
from pipros.msg.dynamic import message_classes_from_text
from pipros.msg.language.parse import parse_action, parse_service
from pipros.msg.language.spec import DefinitionError
from tests.fuzz import mutation
from tests.support.constants import changed

WORDS = [
    *(
        b"int32 ", b"uint8[] ", b"float64[9] ", b"string ", b"Header header\n", b"[", b"]", b"=", b"#", b"\n",
        b" ",
    ),
    *(
        b"=" * 80 + b"\nMSG: a/B\n", b"MSG: ", b"a/B b\n", b"B[] bs\n", b"---\n", b"time ", b"from", b"_",
        b"'", b'"',
    ),
    *(b"[99999999]", b"X=1", b"S= a # b", b"nan", b"True", b"\r\n", b"\t", "ü".encode()),
]  # fmt: skip

LIMITS = Limits(definition_fields=400)
"""Far below the usual ones: what is beyond them is refused at once, so that more inputs are tried."""


@changed(MESSAGE_VALUES=200_000, DEFINITION_COPIES_BYTES=1 << 20)
def target(data: bytes) -> None:
    text = data.decode("utf-8", "replace")
    for parse in (parse_service, parse_action):
        with suppress(DefinitionError):
            parse(text, "a/T")
    try:
        classes: dict[str, Any] = dict(message_classes_from_text("a/T", text, LIMITS))
    except DefinitionError:
        return
    for cls in classes.values():
        written = io.BytesIO()
        message = cls()
        message.serialize(written)
        assert cls().deserialize(written.getvalue())._md5sum == cls._md5sum


if __name__ == "__main__":
    sys.exit(mutation.main(target, "definitions", WORDS))
