"""Any declarations written by a `.cfg` program become a module, or raise the documented errors.

python -m tests.fuzz.cfg_results --seconds 60
"""

import sys

from pipros_libraries.reconfigure.cfg_file import checked_declarations, module_contents
from tests.fuzz import mutation

WORDS = [
    *(
        b"[", b"]", b"{", b"}", b", ", b": ", b'"', b"null", b"true", b"1e999", b"NaN", b"-Infinity",
        b"9" * 5000,
    ),
    *(b'"name"', b'"parameters"', b'"groups"', b'"constants"', b'"description"', b'"level"', b'"default"'),
    *(b'"groups": {"x": ', b'{"parameters": [], "groups": [', b"\\ud800", b"\\u0000", b"\xef\xbb\xbf"),
]  # fmt: skip
LONGER = (5000,)


def target(data: bytes) -> None:
    try:
        declared = checked_declarations(data)
    except (ValueError, RecursionError):
        return
    contents = module_contents(declared)
    assert contents["config_description"] is declared["description"]
    assert contents["defaults"].keys() == contents["level"].keys()


if __name__ == "__main__":
    sys.exit(mutation.main(target, "cfg_results", WORDS, LONGER))
