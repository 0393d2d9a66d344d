"""The command `rosbag` as functions, one for each subcommand.

The functions take the arguments after the subcommand, return None, and raise SystemExit on failure.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence

from pipros.basics.lazy_names import star_names as _star_names
from pipros_tools.cli.rosbag import main as _main
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


def _subcommand(name: str) -> Callable[[Sequence[str]], None]:
    def run(argv: Sequence[str]) -> None:
        if code := _main([name, *argv]):
            sys.exit(code)

    run.__name__ = run.__qualname__ = f"{name}_cmd"
    run.__doc__ = f"Run `rosbag {name}`."
    return run


record_cmd = _subcommand("record")
info_cmd = _subcommand("info")
play_cmd = _subcommand("play")
filter_cmd = _subcommand("filter")
fix_cmd = _subcommand("fix")
check_cmd = _subcommand("check")
compress_cmd = _subcommand("compress")
decompress_cmd = _subcommand("decompress")
reindex_cmd = _subcommand("reindex")
encrypt_cmd = _subcommand("encrypt")
decrypt_cmd = _subcommand("decrypt")
