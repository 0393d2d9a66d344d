"""Imports of numpy and OpenCV, with errors that name the extra to install."""

from __future__ import annotations

from typing import Any

try:
    import numpy as numpy
except ImportError as error:
    raise ImportError(
        "images and cameras need numpy, which is not installed. Try: pip install 'pipros[numpy]'",
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
        raise ImportError(
            f"{purpose} needs OpenCV, which is not installed. Try: pip install 'pipros[vision]'",
            name=error.name,
        ) from error
    return cv2
