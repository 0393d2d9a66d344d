"""Each topic of a bag is exported to a file within the folder, or left out with one line, and exit code 1.

An input is topics, separated by 0xff.

python -m tests.fuzz.export_names --seconds 60
"""

import contextlib
import io
import os
import sys
import tempfile
from pathlib import Path

from std_msgs.msg import Empty

from pipros_tools.bag.info import bag_info
from pipros_tools.bag.info_text import info_text, info_yaml
from pipros_tools.bag.reader import BagReader
from pipros_tools.cli.rosbag import main
from tests.fuzz import mutation
from tests.support.bags import bag_bytes

WORDS = [
    *(
        b"\xff", b"/", b"//", b"/../", b"..", b".", b"__", b"_2", b"/a", b"/A", b"~", b"\0", b"\n",
        b"\x1b[31m",
    ),
    *(b"\\", b"C:", b".csv", b" ", b"/a/b\xff/a_b", "\u202e".encode(), "\xe9".encode(), b"a" * 300),
]  # fmt: skip


def target(data: bytes) -> None:
    topics = dict.fromkeys(part.decode("utf-8", "replace") for part in data.split(b"\xff")[:20])
    content = bag_bytes([(topic, Empty(), n, 0) for n, topic in enumerate(topics)])
    shown = io.StringIO()
    with tempfile.TemporaryDirectory() as place, contextlib.redirect_stdout(shown):
        bag = Path(place, "x.bag")
        bag.write_bytes(content)
        with contextlib.redirect_stderr(shown):
            code = main(["export", str(bag), os.path.join(place, "inner", "out")])
        found = sorted(path.relative_to(place) for path in Path(place).rglob("*") if path.is_file())
        assert found[-1] == Path("x.bag")
        assert all(path.parent == Path("inner/out") for path in found[:-1]), found
        left_out = sum(" is left out: " in line for line in shown.getvalue().splitlines())
        assert len(found) - 1 + left_out == len(topics), (code, found)
        assert code == (1 if left_out else 0)
    with BagReader(io.BytesIO(content)) as reader:
        info = bag_info(reader, None)
    lines = [*shown.getvalue().splitlines(), *info_text(info).split("\n"), *info_yaml(info).split("\n")]
    assert all(line.isprintable() for line in lines), lines
    assert len(info_text(info).split("\n")) == 8 + len(topics)


if __name__ == "__main__":
    sys.exit(mutation.main(target, "export_names", WORDS))
