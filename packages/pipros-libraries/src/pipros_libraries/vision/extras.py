"""Import numpy; if it is not installed, raise an error that names the extra to install."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pipros.basics.extras import missing

if TYPE_CHECKING:
    from typing import Any, TypeAlias

    from numpy.typing import NDArray

    Array: TypeAlias = NDArray[Any]
    """An array; its shape and numbers are those that the docstring states."""

try:
    import numpy as numpy
except ImportError as error:
    raise missing("images and cameras need numpy", "numpy", error) from error
