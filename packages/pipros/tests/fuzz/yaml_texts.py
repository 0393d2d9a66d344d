"""Any YAML text has a value within limits, or raises YamlError.

python -m tests.fuzz.yaml_texts --seconds 60
"""

import sys

from pipros.safe.yaml import YamlError, load_all
from tests.fuzz import mutation
from tests.support.constants import changed

WORDS = [
    *(b"[", b"]", b"{", b"}", b"- ", b"? ", b": ", b", ", b"\n", b"  ", b"---\n", b"...\n", b"#", b"'", b'"'),
    *(b"&a ", b"*a", b"&b ", b"*b", b"<<: *a\n", b"<<: [*a, *b]", b"{<<: *a}", b"=: ", b"[*a, *a, *b]"),
    *(b"!!int ", b"!!float ", b"!!bool ", b"!!binary ", b"!!timestamp ", b"!!set ", b"!!omap ", b"!!pairs "),
    *(b"!!python/name:os.system ", b"!!merge ", b"!!null ", b"!degrees ", b"!radians ", b"rad(", b"deg(pi)"),
    *(
        b"1:30:00", b":59", b"0x1f", b"0b1", b"0o7", b".inf", b".nan", b"1e400",
        b"2001-12-14t21:59:43.10-05:00",
    ),
    *(b"|\n", b">-\n", b"%TAG !a! x:\n", b"%YAML 1.1\n", b"\xff\xfe", b"\xef\xbb\xbf", b"\t", "ü".encode()),
]  # fmt: skip
LONGER = (5000,)
YAML_VALUES = 5000


@changed(YAML_VALUES=YAML_VALUES)
def target(data: bytes) -> None:
    contents: list[str | bytes] = [data, data.decode("utf-8", "replace")]
    for content in contents:
        for angles in (True, False):
            try:
                documents = load_all(content, angles=angles)
            except YamlError:
                continue
            assert values_in(documents) <= YAML_VALUES + 1  # the list of documents


def values_in(value: object) -> int:
    """Count values as if aliases were written out. Stop soon after reaching the limit."""
    count = 0
    waiting = [value]
    while waiting and count <= YAML_VALUES + 1:
        count += 1
        part = waiting.pop()
        if isinstance(part, dict):
            waiting += [each for pair in part.items() for each in pair]
        elif isinstance(part, (list, set)):
            waiting += part
    return count


if __name__ == "__main__":
    sys.exit(mutation.main(target, "yaml_texts", WORDS, LONGER))
