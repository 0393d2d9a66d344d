"""Inputs for fuzz targets: a corpus, and endless mutations of it that a seed makes repeatable."""

from __future__ import annotations

import argparse
import random
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

CORPUS = Path(__file__).parent / "corpus"
AWKWARD = [b"\0", b"\xff", b"\x80", b"\xff\xff\xff\xff", b"\0\0\0\0", b"\x01\0\0\0", b"\xff\xff\xff\x7f"]

Target = Callable[[bytes], None]


def corpus(name: str) -> list[bytes]:
    """The inputs that were kept for a target, in a fixed order."""
    return [file.read_bytes() for file in sorted((CORPUS / name).iterdir())]


def mutations(inputs: Sequence[bytes], seed: int, words: Sequence[bytes] = ()) -> Iterator[bytes]:
    """Mutated inputs without end; `words` are pieces that the target knows."""
    rng = random.Random(seed)  # noqa: S311
    while True:
        data = bytearray(rng.choice(inputs))
        for _ in range(rng.choice([1, 1, 1, 2, 3, 8])):
            _mutate(data, rng, inputs, [*AWKWARD, *words])
        yield bytes(data)


def _mutate(data: bytearray, rng: random.Random, inputs: Sequence[bytes], words: Sequence[bytes]) -> None:
    start = rng.randint(0, len(data))
    end = min(len(data), start + rng.choice([1, 1, 4, 4, 16, 200]))
    action = rng.randrange(6)
    if action == 0 and data:
        data[start % len(data)] ^= 1 << rng.randrange(8)
    elif action == 1:
        del data[start:end]
    elif action == 2:
        data[start:end] = rng.choice(words)
    elif action == 3:
        data[start:start] = rng.choice(words)
    elif action == 4:
        data[start:start] = data[start:end] * rng.choice([1, 2, 50])
    else:
        other = rng.choice(inputs)
        cut = rng.randint(0, len(other))
        data[start:] = other[cut:]


def main(target: Target, name: str, words: Sequence[bytes] = ()) -> int:
    """Runs a target on its corpus and on mutations of it until the time is up or it fails."""
    parser = argparse.ArgumentParser(description=f"Fuzzes {name}.")
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=time.time_ns() % 2**32)
    arguments = parser.parse_args()
    print(f"{name}: seed {arguments.seed}", flush=True)
    inputs = corpus(name)
    end = time.monotonic() + arguments.seconds
    count = 0
    for data in (*inputs, *inputs):
        target(data)
    for data in mutations(inputs, arguments.seed, words):
        if time.monotonic() > end:
            break
        count += 1
        try:
            target(data)
        except Exception:
            failed = Path(f"failed-{name}-{arguments.seed}-{count}")
            failed.write_bytes(data)
            print(f"{name}: failed on {failed}; keep it in {CORPUS / name}", file=sys.stderr)
            raise
    print(f"{name}: {count} inputs")
    return 0
