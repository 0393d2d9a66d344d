"""Import numpy, with an error message that names the extra to install."""

from __future__ import annotations

from pipros.basics.errors import MissingExtra
from pipros.basics.extras import install_command

try:
    import numpy as numpy
except ImportError as error:
    raise MissingExtra(
        f"images and cameras need numpy, which is not installed. Try: {install_command('numpy')}",
        name=error.name,
    ) from error
