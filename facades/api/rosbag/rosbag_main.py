"""The command `rosbag` as functions, one for each subcommand.

They take the arguments after the subcommand, return None, and raise SystemExit on failure.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

from pipros.basics.lazy_names import star_names as _star_names
from pipros.cli.rosbag import main as _main
from rosbag.bag import (
    Bag,
    Compression,
    ROSBagEncryptException,
    ROSBagEncryptNotSupportedException,
    ROSBagException,
    ROSBagFormatException,
    ROSBagUnindexedException,
)
from rosbag.migration import MessageMigrator, checkbag, fixbag2

__all__ = [
    "Bag",
    "Compression",
    "MessageMigrator",
    "ROSBagEncryptException",
    "ROSBagEncryptNotSupportedException",
    "ROSBagException",
    "ROSBagFormatException",
    "ROSBagUnindexedException",
    "check_cmd",
    "checkbag",
    "compress_cmd",
    "decompress_cmd",
    "decrypt_cmd",
    "encrypt_cmd",
    "filter_cmd",
    "fix_cmd",
    "fixbag2",
    "info_cmd",
    "play_cmd",
    "record_cmd",
    "reindex_cmd",
    "rosbagmain",
]

_star_names(
    __name__,
    "UserDict=collections:UserDict optparse os print_function=__future__:print_function roslib shutil signal "
    "subprocess sys time",
)


def rosbagmain(argv: Sequence[str] | None = None) -> None:
    """Run the command `rosbag`, and raise SystemExit with its exit code. `argv[0]` is the command's name."""
    sys.exit(_main(list(sys.argv if argv is None else argv)[1:]))


def _run(subcommand: str, argv: Sequence[str]) -> None:
    if code := _main([subcommand, *argv]):
        sys.exit(code)


def record_cmd(argv: Sequence[str]) -> None:
    """Run `rosbag record`."""
    _run("record", argv)


def info_cmd(argv: Sequence[str]) -> None:
    """Run `rosbag info`."""
    _run("info", argv)


def play_cmd(argv: Sequence[str]) -> None:
    """Run `rosbag play`."""
    _run("play", argv)


def filter_cmd(argv: Sequence[str]) -> None:
    """Run `rosbag filter`."""
    _run("filter", argv)


def fix_cmd(argv: Sequence[str]) -> None:
    """Run `rosbag fix`."""
    _run("fix", argv)


def check_cmd(argv: Sequence[str]) -> None:
    """Run `rosbag check`."""
    _run("check", argv)


def compress_cmd(argv: Sequence[str]) -> None:
    """Run `rosbag compress`."""
    _run("compress", argv)


def decompress_cmd(argv: Sequence[str]) -> None:
    """Run `rosbag decompress`."""
    _run("decompress", argv)


def reindex_cmd(argv: Sequence[str]) -> None:
    """Run `rosbag reindex`."""
    _run("reindex", argv)


def encrypt_cmd(argv: Sequence[str]) -> None:
    """Run `rosbag encrypt`."""
    _run("encrypt", argv)


def decrypt_cmd(argv: Sequence[str]) -> None:
    """Run `rosbag decrypt`."""
    _run("decrypt", argv)
