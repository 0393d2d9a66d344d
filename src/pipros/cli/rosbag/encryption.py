"""`rosbag encrypt` and `decrypt`, which pipros does not do."""

from __future__ import annotations

from collections.abc import Sequence

from pipros.bag.reader import BagReader
from pipros.cli.program import CommandError, option_parser

_CURE = "Use genuine rosbag with GnuPG for it, and keep the result on an encrypted disk or encrypt the file"


def decrypt(argv: Sequence[str]) -> int:
    return _refuse("decrypt", "Decrypt one or more bag files.", argv)


def encrypt(argv: Sequence[str]) -> int:
    return _refuse("encrypt", "Encrypt one or more bag files.", argv)


def _refuse(name: str, description: str, argv: Sequence[str]) -> int:
    parser = option_parser("rosbag", "", description)
    parser.usage = f"rosbag {name} [options] BAGFILE1 [BAGFILE2 ...]"
    _, paths = parser.parse_args(
        [argument for argument in argv if not argument.startswith("-") or argument in ("-h", "--help")]
    )
    if not paths:
        parser.error("You must specify at least one bag file.")
    for path in paths:
        with BagReader(path):  # says what is wrong with the file, an encrypted one among that
            pass
    what = "is not encrypted, so there is nothing to decrypt" if name == "decrypt" else "cannot be encrypted"
    raise CommandError(f"[{paths[0]}] {what}; pipros has no encryption of bags. {_CURE}")
