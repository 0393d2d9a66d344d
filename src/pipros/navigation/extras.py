"""The error for a library that the extra `navigation` installs."""

from __future__ import annotations

import sys

from pipros.basics.errors import MissingExtra
from pipros.basics.extras import install_command


def missing_extra(error: ImportError) -> MissingExtra:
    """Return the error that names the missing library and the command that installs it.

    Raises:
        KeyboardInterrupt: Ctrl-C interrupted the import of numpy, whose C code prints it, which sets
            `sys.last_type`, and raises ImportError instead.
    """
    if error.name is None and getattr(sys, "last_type", None) is KeyboardInterrupt:
        raise KeyboardInterrupt from None
    what = f"{error.name}, which is not installed" if error.name else f"a library that fails: {error}"
    return MissingExtra(f"this node needs {what}. Try: {install_command('navigation')}", name=error.name)
