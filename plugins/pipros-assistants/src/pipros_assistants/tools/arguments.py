"""Argument types that several tools share."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

Name = Annotated[str, Field(min_length=1, max_length=500)]
Namespace = Annotated[str, Field(min_length=1, max_length=500, description="a namespace, such as /robot")]
Cursor = Annotated[int, Field(ge=0, le=10**9, description="0, or the field next of the previous answer")]
Part = Annotated[
    str,
    Field(
        max_length=500,
        description="a part of the messages, such as pose/position/x or ranges[0:10]; empty for all",
    ),
]
Wait = Annotated[float, Field(ge=0.1, le=30.0, description="time to wait for messages, in seconds")]
