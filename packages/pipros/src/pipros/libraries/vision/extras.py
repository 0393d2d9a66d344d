"""Import numpy; if it is not installed, raise an error that names the extra to install."""

from __future__ import annotations

from pipros.basics.extras import missing

try:
    import numpy as numpy
except ImportError as error:
    raise missing("images and cameras need numpy", "numpy", error) from error
