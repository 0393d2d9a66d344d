"""Inputs for fuzz targets: a corpus, and endless mutations of it, reproducible by a seed.

A target fails if it raises, uses more than `MEMORY_BYTES`, or takes more than `SECONDS_FOR_ONE`
of processor time for an input. The current input is in a file, which is still there after a crash.
"""

import argparse
import math
import random
import resource
import signal
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

CORPUS = Path(__file__).parent / "corpus"
AWKWARD = [b"\0", b"\xff", b"\x80", b"\xff\xff\xff\xff", b"\0\0\0\0", b"\x01\0\0\0", b"\xff\xff\xff\x7f"]

MEMORY_BYTES = 2 << 30
SECONDS_FOR_ONE = 10.0

Target = Callable[[bytes], None]


class TooSlow(Exception):
    """An input took more than `SECONDS_FOR_ONE` of processor time."""


def corpus(name: str) -> list[bytes]:
    """Return the stored inputs of a target, in a fixed order."""
    return [file.read_bytes() for file in sorted((CORPUS / name).iterdir())]


def mutations(
    inputs: Sequence[bytes], seed: int, words: Sequence[bytes] = (), longer: Sequence[int] = ()
) -> Iterator[bytes]:
    """Yield mutated inputs, endlessly.

    Args:
        words: pieces that the target knows.
        longer: numbers of repetitions of a piece, in addition to those up to 50.
    """
    rng = random.Random(seed)  # noqa: S311
    while True:
        data = bytearray(rng.choice(inputs))
        for _ in range(rng.choice([1, 1, 1, 2, 3, 8])):
            _mutate(data, rng, inputs, [*AWKWARD, *words], longer)
        yield bytes(data)


def _mutate(
    data: bytearray,
    rng: random.Random,
    inputs: Sequence[bytes],
    words: Sequence[bytes],
    longer: Sequence[int],
) -> None:
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
        data[start:start] = data[start:end] * rng.choice([1, 2, 50, *longer])
    else:
        other = rng.choice(inputs)
        cut = rng.randint(0, len(other))
        data[start:] = other[cut:]


@contextmanager
def bounded() -> Iterator[None]:
    """Raise `TooSlow` if the block takes too long."""

    def stop(*_: object) -> None:
        raise TooSlow(f"more than {SECONDS_FOR_ONE} s of processor time")

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, SECONDS_FOR_ONE)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


def main(target: Target, name: str, words: Sequence[bytes] = (), longer: Sequence[int] = ()) -> int:
    """Run a target on its corpus and on mutations of it until the limit is reached or the target fails."""
    parser = argparse.ArgumentParser(description=f"Fuzzes {name}.")
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--inputs", type=int, help="run so many mutations, however long it takes")
    parser.add_argument("--seed", type=int, default=time.time_ns() % 2**32)
    arguments = parser.parse_args()
    print(f"{name}: seed {arguments.seed}", flush=True)
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
    inputs = corpus(name)
    end = time.monotonic() + (math.inf if arguments.inputs else arguments.seconds)
    count = 0
    for data in (*inputs, *inputs):
        with bounded():
            target(data)
    failed = Path(f"failed-{name}-{arguments.seed}")
    with failed.open("wb", buffering=0) as present:
        for data in mutations(inputs, arguments.seed, words, longer):
            if time.monotonic() > end or count == arguments.inputs:
                break
            count += 1
            present.seek(0)
            present.truncate()
            present.write(data)
            try:
                with bounded():
                    target(data)
            except BaseException:
                print(f"{name}: input {count} is in {failed}; keep it in {CORPUS / name}", file=sys.stderr)
                raise
    failed.unlink()
    print(f"{name}: {count} inputs")
    return 0
