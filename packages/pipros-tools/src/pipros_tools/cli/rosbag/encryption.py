"""`rosbag encrypt` and `decrypt`, which pipros does not support."""

from __future__ import annotations

from collections.abc import Sequence
from optparse import OptionParser

from pipros_tools.bag.reader import BagReader
from pipros_tools.cli.rosbag.rewriting import bag_parser
from pipros_tools.cli.runner import CommandError, add_flag

_CURE = "Use genuine rosbag with GnuPG, keep the bag on an encrypted disk, or encrypt the file"


def decrypt(argv: Sequence[str]) -> int:
    return _refuse(bag_parser("decrypt", "Decrypt one or more bag files."), argv, "decrypt")


def encrypt(argv: Sequence[str]) -> int:
    parser = bag_parser("encrypt", "Encrypt one or more bag files.")
    parser.add_option("-p", "--plugin", dest="plugin", default="", help="encryptor name (not supported)")
    parser.add_option("-r", "--param", dest="param", default="", help="encryptor parameter (not supported)")
    return _refuse(parser, argv, "encrypt")


def _refuse(parser: OptionParser, argv: Sequence[str], name: str) -> int:
    add_flag(parser, "-j", "--bz2", dest="is_bz2", help="use BZ2 compression")
    add_flag(parser, "--lz4", dest="is_lz4", help="use lz4 compression")
    _, paths = parser.parse_args(list(argv))
    if not paths:
        parser.error("You must specify at least one bag file.")
    for path in paths:
        with BagReader(path):  # opening the file reports any problems with it, including encryption
            pass
    if name == "decrypt":
        raise CommandError(f"[{paths[0]}] is not encrypted, so there is nothing to decrypt")
    raise CommandError(f"cannot encrypt [{paths[0]}]: pipros does not support encrypted bags. {_CURE}")
