from __future__ import annotations

import io

from pipros_tools.launch.guardian import read_groups


def test_the_guardian_knows_which_groups_are_left() -> None:
    lines = io.StringIO("+10\n+11\n+12\n-11\n+1\n+0\n+-5\ngarbage\n+13")
    assert read_groups(lines) == {10, 12, 13}
