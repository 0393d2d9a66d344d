"""The functions of the module that genuine cv_bridge has in C++; all run on numpy."""

from __future__ import annotations

from pipros.vision.conversions import convert as cvtColor2
from pipros.vision.conversions import convert_for_display as cvtColorForDisplay
from pipros.vision.encodings import CHANNEL_STEP, encoding

__all__ = ["CV_MAT_CNWrap", "CV_MAT_DEPTHWrap", "cvtColor2", "cvtColorForDisplay", "getCvType"]


def getCvType(encoding_name: str) -> int:
    """The number that OpenCV gives to the type of an encoding's pixels, such as 16 for rgb8.

    Raises:
        RuntimeError: no encoding has this name.
    """
    return encoding(encoding_name).cv_type


def CV_MAT_CNWrap(cv_type: int) -> int:
    """The channels of a type of OpenCV."""
    return cv_type // CHANNEL_STEP + 1


def CV_MAT_DEPTHWrap(cv_type: int) -> int:
    """The number of the type of each value of a type of OpenCV."""
    return cv_type % CHANNEL_STEP
