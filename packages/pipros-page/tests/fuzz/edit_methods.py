"""Any enum description of a dynamic_reconfigure server becomes valid constants, or none.

python -m tests.fuzz.edit_methods --seconds 60
"""

import json
import sys
import tracemalloc
import warnings

from pipros_libraries.reconfigure.config import BadValue, constants, converted
from pipros_libraries.reconfigure.generator import TYPES
from pipros_page.views.reconfigure import shown_group
from tests.fuzz import mutation

WORDS = [
    *(b"{'enum': [", b"{'name': 'a', 'type': 'int', 'value': 1}", b"'type': 'str'", b"'double'", b"'bool'"),
    *(b"[", b"]", b"(", b")", b"{", b"}", b",", b"-", b"1e999", b"nan", b"0x" + b"f" * 30, b"1j", b"b'x'"),
    *(b"None", b"True", b"'", b'"""', b"\\x00", b"lambda: 0", b"*", b"\n", b"#", b"f'{1}'"),
]
MEMORY_BYTES = 150 << 20


def target(data: bytes) -> None:
    text = data.decode("utf-8", "replace")
    tracemalloc.start()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a warning of Python's parser
            found = constants(text)
    finally:
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    assert peak < MEMORY_BYTES, f"{peak} bytes for {len(data)}"
    assert found == constants(text)
    bounds = {"min": 0, "max": 1, "default": 0, "description": "", "level": 0}
    for kind in TYPES:
        described = {"name": "x", "type": kind, "edit_method": text, **bounds}
        json.dumps(shown_group({"parameters": [described]}), allow_nan=False)
        for constant in found:
            try:
                converted(described, constant["name"])
            except BadValue:
                continue


if __name__ == "__main__":
    sys.exit(mutation.main(target, "edit_methods", WORDS, longer=(2000,)))
