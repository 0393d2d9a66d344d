"""The page's table of primitive message types: `python -m tests.support.page_primitives` writes it.

It is derived from `pipros.msg.language.spec`; `tests.unit.web.test_page_files` compares the file.
"""

import struct

from pipros.msg.language.spec import FLOATS, NUMBERS
from tests.support.environments import source

FILE = source("pipros_page/page/scene/primitives.js")


def module() -> str:
    """Return the contents of the JavaScript module."""
    lines = [
        "// Numbers in messages: the suffix of the methods of DataView, and the size in bytes.",
        "// Written by `python -m tests.support.page_primitives` from the definitions of the library.",
        "",
        "export const PRIMITIVES = {",
    ]
    for name, code in NUMBERS.items():
        size = struct.calcsize(f"<{code}")
        kind = "Float" if name in FLOATS else "Int" if code.islower() else "Uint"
        big = "Big" if size == 8 and name not in FLOATS else ""
        lines.append(f'  {name}: ["{big}{kind}{8 * size}", {size}],')
    return "\n".join([*lines, "};", ""])


if __name__ == "__main__":
    FILE.write_text(module())
