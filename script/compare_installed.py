"""Compare pipros in two environments, as one wheel and as one of each package; see `script/rooms --apart`.

The arguments are their `site-packages`. Each file, program and entry point must have the same content in
both, and belong to one distribution in each. Each distribution must contain the licence.
"""

from __future__ import annotations

import hashlib
import sys
from importlib.metadata import distributions


def installed(folder: str) -> tuple[dict[str, str], list[str]]:
    """Return what pipros installed into a folder, with its content, and what is wrong with it."""
    found: dict[str, str] = {}
    wrong = []
    for distribution in distributions(path=[folder]):
        entries = {f"entry point {each.group}: {each.name}": each.value for each in distribution.entry_points}
        for file in distribution.files or ():
            content = file.read_binary()
            if file.parts[0] == "..":  # a program, whose first line names the interpreter
                content = content.partition(b"\n")[2]
            if not file.parts[0].endswith(".dist-info"):
                entries[str(file)] = hashlib.sha256(content).hexdigest()
        if not any(str(file).endswith(".dist-info/licenses/LICENSE") for file in distribution.files or ()):
            wrong.append(f"{distribution.name}: no LICENSE")
        wrong += [f"{name}: two distributions have it" for name in entries if name in found]
        found.update(entries)
    return found, wrong


def main(one: str, apart: str) -> int:
    """Print all differences. Return the exit code."""
    (expected, wrong), (found, wrong_apart) = installed(one), installed(apart)
    print("".join(f"{each}\n" for each in sorted([*wrong, *wrong_apart])), end="")
    different = sorted(name for name in {*expected, *found} if expected.get(name) != found.get(name))
    for name in different:
        print(f"{name}: {'different' if name in expected and name in found else 'only in one environment'}")
    print(f"{len(expected)} files, programs and entry points in the one wheel, {len(found)} in the others")
    return 1 if wrong or wrong_apart or different or not expected else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
