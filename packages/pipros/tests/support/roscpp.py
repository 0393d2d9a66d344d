"""C++ programs that use genuine roscpp, each compiled from one file, once per machine."""

import subprocess
from pathlib import Path

from tests.support.once import machine_folder, make_once

_BARE = {"PATH": "/usr/bin:/bin"}


def compile_program(source: Path, *packages: str) -> Path:
    """Compile a source file that uses these packages. Return the program, which is kept for later runs."""
    program = machine_folder(source.stem, (source, Path(__file__))) / source.stem

    def make() -> None:
        flags = subprocess.run(
            ["/usr/bin/pkg-config", "--cflags", "--libs", *packages, "roscpp"], check=True,
            capture_output=True, text=True, env=_BARE,
        ).stdout.split()  # fmt: skip
        subprocess.run(["/usr/bin/g++", "-o", program, source, *flags], check=True, env=_BARE)

    make_once(program.parent, make)
    return program
