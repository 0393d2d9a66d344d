"""Start the programs of the navigation packages. These programs need the extra `navigation`."""

from __future__ import annotations

import os
import sys
from importlib import import_module

from pipros.basics.extras import missing
from pipros_libraries.nodes.kept_memory import keep_freed_memory


def run_program(module: str, *arguments: str) -> int:
    """Run `main` in a module of `pipros_robot.navigation`, and return the exit code.

    If a required library is missing or cannot be imported, print an error and return 1.
    """
    # For matrices of 15 rows, OpenBLAS's threads bring no benefit, but burn CPU time in busy waits.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    keep_freed_memory()
    try:
        program = import_module(f"pipros_robot.navigation.{module}")
    except ImportError as error:
        if error.name not in ("numpy", "cv2", None):
            raise
        what = f"this node needs {error.name or 'a library'}"
        print(f"ERROR: {missing(what, 'pipros-robot', error)}", file=sys.stderr)
        return 1
    return int(program.main(*arguments))
