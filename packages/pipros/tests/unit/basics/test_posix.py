"""Features of POSIX systems, and their substitutes on other systems."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from pipros.basics import posix
from pipros.basics.errors import NeedsPosix, PiprosError
from pipros.basics.posix import NO_LINK, READ, descriptor_limit, signal_group, user_id
from tests.support.without_posix import run_without_posix

WITHOUT = """
import sys
from pipros.basics import posix, terminals
from pipros.basics.errors import NeedsPosix

posix.call_in_children(lambda: None)
posix.raise_descriptor_limit(1 << 16)
posix.make_room_for_descriptors(64)
posix.give_to("/no/such/file", 1, 1)
with terminals.single_keys() as has_keys:
    print(posix.user_id(), posix.descriptor_limit(), has_keys)
for call in (lambda: posix.signal_group(2, 0), lambda: terminals.open_pty(1)):
    try:
        call()
    except NeedsPosix as error:
        print(error)
"""


def test_without_posix_each_function_has_a_harmless_result_or_an_error_of_one_line() -> None:
    assert run_without_posix(WITHOUT).splitlines() == [
        "0 8192 False",
        f"a process group needs a POSIX system, but this is {posix.sys.platform}",
        f"a pty needs a POSIX system, but this is {posix.sys.platform}",
    ]
    assert issubclass(NeedsPosix, PiprosError)


def test_the_user_is_the_owner_of_new_files(tmp_path: Path) -> None:
    assert user_id() == tmp_path.stat().st_uid


@pytest.mark.needs("process groups")
def test_a_group_that_does_not_exist_cannot_get_signals() -> None:
    with pytest.raises(ProcessLookupError):
        signal_group(2**22 + 1, 0)  # above the highest process id of Linux


def test_a_descriptor_below_the_limit_can_be_opened() -> None:
    descriptor = os.open(os.devnull, READ)
    os.close(descriptor)
    assert descriptor < descriptor_limit()


@pytest.mark.needs("O_NOFOLLOW")
def test_a_link_is_refused(tmp_path: Path) -> None:
    link = tmp_path / "link"
    link.symlink_to(os.devnull)
    with pytest.raises(OSError, match="symbolic links"):
        os.open(link, READ | NO_LINK)
