"""Import OpenCV, with an error message that names the extra to install."""

from __future__ import annotations

from typing import Any

from pipros.basics.errors import MissingExtra
from pipros.basics.extras import install_command


def opencv(purpose: str) -> Any:
    """Import and return the module `cv2`.

    Raises:
        MissingExtra: OpenCV, or numpy, which it needs, is not installed. The message names `purpose` and the
            command that installs both.
    """
    try:
        import cv2
    except ImportError as error:
        raise MissingExtra(
            f"{purpose} needs OpenCV, which is not installed. Try: {install_command('vision')}",
            name=error.name,
        ) from error
    return cv2
