"""What is wrong with the definitions of a package, all of it."""

from __future__ import annotations

from pipros.msg.compile.mistakes import find_mistakes
from tests.support.definitions import Packages


def test_all_mistakes_of_a_package_can_be_had_at_once(packages: Packages) -> None:
    packages.write("robot/msg/Good.msg", "int32 x")
    packages.write("robot/msg/Two.msg", "int32\nint32 x\nint32 a b c")
    packages.write("robot/msg/Lost.msg", "No_such x")
    packages.write("robot/msg/Circle.msg", "Circle x")
    packages.write("robot/msg/Uses.msg", "Two two")
    packages.write("robot/action/Do.action", "int32 x")

    found = [
        str(mistake).removeprefix(f"{packages.folder}/robot/")
        for mistake in find_mistakes("robot", packages.definitions)
    ]

    assert [text.partition(": ")[0] for text in found] == [
        *("msg/Circle.msg:1:1", "action/Do.action", "msg/Lost.msg:1:1", "msg/Two.msg:1:1", "msg/Two.msg:3:1"),
    ]
