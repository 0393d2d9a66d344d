"""Import OpenCV; if it is not installed, raise an error that names the extra to install."""

from __future__ import annotations

from typing import Any

from pipros.basics.extras import missing


def opencv(purpose: str) -> Any:
    """Import and return the module `cv2`.

    Raises:
        MissingExtra: OpenCV, or numpy, which OpenCV needs, is not installed. The message names `purpose` and
            the command that installs both.
    """
    try:
        import cv2
    except ImportError as error:
        raise missing(f"{purpose} needs OpenCV", "vision", error) from error
    return cv2
