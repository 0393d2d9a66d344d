"""Start the programs of the navigation packages. These programs need the extra `navigation`."""

from __future__ import annotations

import os
import sys
from importlib import import_module

from pipros.basics.errors import MissingExtra
from pipros.basics.extras import install_command


def run_program(module: str, *arguments: str) -> int:
    """Run `main` in a module of `pipros.navigation`, and return the exit code.

    If a required library is missing or cannot be imported, print an error and return 1.
    """
    # For matrices of 15 rows, OpenBLAS's threads bring no benefit, but burn CPU time in busy waits.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        program = import_module(f"pipros.navigation.{module}")
    except ImportError as error:
        if error.name not in ("numpy", "cv2", None):
            raise
        print(f"ERROR: {missing_extra(error)}", file=sys.stderr)
        return 1
    return int(program.main(*arguments))


def missing_extra(error: ImportError) -> MissingExtra:
    """Return an error that names the missing library and the command that installs it.

    Raises:
        KeyboardInterrupt: Ctrl-C interrupted the import of numpy. In this case, numpy's C code prints the
            exception, which sets `sys.last_type`, and raises ImportError.
    """
    if error.name is None and getattr(sys, "last_type", None) is KeyboardInterrupt:
        raise KeyboardInterrupt from None
    what = (
        f"{error.name}, which is not installed"
        if error.name
        else f"a library that cannot be imported: {error}"
    )
    return MissingExtra(f"this node needs {what}. Try: {install_command('navigation')}", name=error.name)
