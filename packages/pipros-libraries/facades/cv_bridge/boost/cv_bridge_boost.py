"""Python implementations of the functions in Noetic's C++ module."""

from __future__ import annotations

from pipros_libraries.pictures.encodings import CHANNEL_STEP, encoding
from pipros_libraries.vision.conversions import convert as cvtColor2
from pipros_libraries.vision.conversions import convert_for_display as cvtColorForDisplay

__all__ = ["CV_MAT_CNWrap", "CV_MAT_DEPTHWrap", "cvtColor2", "cvtColorForDisplay", "getCvType"]


def getCvType(encoding_name: str) -> int:
    """Return the OpenCV type of an encoding, such as 16 for rgb8.

    Raises:
        RuntimeError: the encoding is unknown.
    """
    return encoding(encoding_name).cv_type


def CV_MAT_CNWrap(cv_type: int) -> int:
    """Return the number of channels of an OpenCV type."""
    return cv_type // CHANNEL_STEP + 1


def CV_MAT_DEPTHWrap(cv_type: int) -> int:
    """Return the depth of an OpenCV type."""
    return cv_type % CHANNEL_STEP
