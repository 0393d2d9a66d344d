"""The error for a library that the extra `navigation` installs."""

from __future__ import annotations

from pipros.basics.errors import MissingExtra
from pipros.basics.extras import install_command


def missing_extra(error: ImportError) -> MissingExtra:
    """Return the error that names the missing library and the command that installs it.

    Raises:
        KeyboardInterrupt: Ctrl-C interrupted the import of numpy, whose C code reports it and raises
            ImportError instead.
    """
    if "multiarray failed to import" in str(error):
        raise KeyboardInterrupt from None
    return MissingExtra(
        f"this node needs {error.name}, which is not installed. Try: {install_command('navigation')}",
        name=error.name,
    )
