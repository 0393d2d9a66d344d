"""Directories and tokens of any members stay within the bytes and the topics of each of them.

An input is a list of messages, each after its length in two bytes. The first byte of a message selects the
member that sends it, the second the kind: a token that appears or disappears, or a directory.

python -m tests.fuzz.fleet_directories --seconds 60
"""

import sys

from pipros.basics.errors import PiprosError
from pipros.basics.shares import fair_shares
from pipros_fleet import keys
from pipros_fleet.directory import Directory, DirectoryEntry, from_json, to_json
from pipros_fleet.members import TOKENS_PER_MEMBER, Members
from tests.fuzz import mutation
from tests.fuzz.rtps import read_input, write_input

MAX_MEMBERS, MAX_TOPICS, MAX_BYTES = 3, 20, 20_000
_ENTRIES = tuple(DirectoryEntry(f"/topic{number}", "std_msgs/String", "0" * 32) for number in range(12))
WORDS = [
    *(write_input(bytes([member, kind]) + b"%016d" % member) for member in range(5) for kind in range(2)),
    *(
        write_input(bytes([member, 2]) + to_json(Directory(f"m{member}", "0" * 16, 1, _ENTRIES[:count])))
        for member, count in ((0, 1), (1, 12), (2, 3))
    ),
    b"0000000000000001", b'["/a","a/B","', b"[[[[", b"1e999", b'"revision"',
]  # fmt: skip


def target(data: bytes) -> None:
    members = Members(MAX_MEMBERS)
    directories: dict[str, Directory] = {}
    for part in read_input(data):
        member, kind, rest = f"m{part[0] % 8 if part else 0}", part[1] % 3 if len(part) > 1 else 0, part[2:]
        if kind < 2:
            instance = rest[:16].decode("ascii", "replace")
            members.update(f"{keys.live(member, keys.VERSION, '')}{instance}", is_present=kind == 0)
            members.admit_waiting()
            continue
        try:
            found = from_json(rest, member, MAX_BYTES)
        except PiprosError:
            continue
        assert len(rest) <= MAX_BYTES
        directories[member] = found
    present = members.present()
    assert len(present) <= MAX_MEMBERS
    assert all(len(members.of(member)) <= TOKENS_PER_MEMBER for member in present)
    sizes = {member: each.size for member, each in directories.items()}
    shares = fair_shares(sizes, MAX_TOPICS)
    equal = MAX_TOPICS // max(1, len(sizes))
    assert sum(shares.values()) <= MAX_TOPICS
    assert all(shares[member] >= min(size, equal) for member, size in sizes.items())


if __name__ == "__main__":
    sys.exit(mutation.main(target, "fleet_directories", WORDS))
