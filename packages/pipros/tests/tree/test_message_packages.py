"""The Python packages of the shipped messages are those that `script/generate messages` writes."""

from __future__ import annotations

from tests.support.environments import FACADES, REPOSITORY, files_below
from tests.support.message_packages import message_packages


def test_the_packages_of_messages_are_made_from_their_definitions() -> None:
    written = dict(message_packages(REPOSITORY))

    assert [file for file, text in written.items() if not file.is_file() or file.read_text() != text] == []


def test_no_package_of_messages_is_left_without_definitions() -> None:
    written = {
        file.relative_to(file.parents[2] if file.parent.name in ("msg", "srv") else file.parents[1])
        for file, _ in message_packages(REPOSITORY)
    }
    found = {file.relative_to(folder) for folder in FACADES for file in files_below(folder, "*.pyi")}

    assert found - written == set()
