"""Imports of numpy and OpenCV, with error messages that name the extra to install."""

from __future__ import annotations

from typing import Any

from pipros.basics.errors import MissingExtra
from pipros.basics.extras import install_command

try:
    import numpy as numpy
except ImportError as error:
    raise MissingExtra(
        f"images and cameras need numpy, which is not installed. Try: {install_command('numpy')}",
        name=error.name,
    ) from error


def opencv(purpose: str) -> Any:
    """Import and return the module `cv2`.

    Raises:
        ImportError: OpenCV is not installed. The message names `purpose` and how to install it.
    """
    try:
        import cv2
    except ImportError as error:
        raise MissingExtra(
            f"{purpose} needs OpenCV, which is not installed. Try: {install_command('vision')}",
            name=error.name,
        ) from error
    return cv2
