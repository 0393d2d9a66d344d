"""Random message definitions: every field type, awkward names, constants, nesting."""

import random

SEPARATOR = "=" * 80
HEADER = f"{SEPARATOR}\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n"

TYPES = [
    *("bool", "byte", "char", "string", "time", "duration", "float32", "float64"),
    *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)),
]
NAMES = ["from", "class", "None", "print", "async", "x", "data", "name", "len", "bytes", "add", "buff", "w0"]
NAMES += ["header", "stamp", "match", "type", "id", "int", "float", "self_", "o1", "m0", "numpy", "str"]
CONSTANTS = [
    *("int32 C=-99", 'string S= a b # c "q" ', "float64 F = 1.5e3 # x", "bool B=True", "float32 float=2"),
    *("uint8 CH=200", "string EMPTY=", "int8 except=-1", "uint64 BIG=18446744073709551615", "byte BY=-128"),
]


def full_text(seed: int) -> str:
    """Return the full text of a random type and its embedded types; the same for the same seed."""
    rng = random.Random(seed)  # noqa: S311
    embedded: list[str] = []
    parts: list[str] = []
    for number in range(rng.randint(0, 4)):
        parts.insert(0, f"{SEPARATOR}\nMSG: made/In{number}\n{_definition(rng, embedded)}\n")
        embedded.append(rng.choice([f"made/In{number}", f"In{number}"]))
    return f"{_definition(rng, embedded)}\n{''.join(parts)}{HEADER}"


def _definition(rng: random.Random, embedded: list[str]) -> str:
    lines = rng.sample(CONSTANTS, rng.randint(0, 3))
    used = {line.partition("=")[0].split()[1] for line in lines}
    for number in range(rng.randint(0, 8)):
        name = rng.choice([*NAMES, *[f"f{number}"] * 30])
        if name in used:
            continue
        used.add(name)
        array = rng.choice(["", "", "", "[]", "[3]", "[0]", "[1]", "[70]" if rng.random() < 0.1 else ""])
        comment = rng.choice(["", "  # comment", " "])
        lines.append(f"{rng.choice(TYPES + embedded * 4)}{array} {name}{comment}")
    if "header" not in used and rng.random() < 0.3:
        lines.insert(0, "Header header")
    if rng.random() < 0.5:
        rng.shuffle(lines)
    return "\n".join(lines)
