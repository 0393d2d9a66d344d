"""tf_conversions and tf2_kdl without PyKDL."""

import subprocess
import sys

PROGRAM = """
import sys; sys.modules['PyKDL'] = None
import tf_conversions
def use():
    tf_conversions.fromTf(((1, 2, 3), (0, 0, 0, 1)))
def load():
    import tf2_kdl
for each in (use, load):
    try:
        each()
    except ImportError as error:
        print(error)
"""


def test_without_pykdl_the_error_says_what_to_install() -> None:
    ended = subprocess.run([sys.executable, "-c", PROGRAM], stdout=subprocess.PIPE, text=True, check=True)
    for package, line in zip(("tf_conversions", "tf2_kdl"), ended.stdout.splitlines(), strict=True):
        assert f"{package} needs PyKDL" in line
        assert "python3-pykdl" in line
