"""Which stage a transcript wants, and what differs from run to run."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

from tests.golden.cli.stage import Stage

MASKS = {
    r"(127\.0\.0\.1|localhost):(?!1\b)\d+": r"\1:PORT",
    r"time=[\d.]+ms": "time=N ms",
    r"average: [\d.]+ms": "average: N ms",
    r"seq: +\d+": "seq: N",  # genuine ROS counts a latched message anew for each subscriber
    r"\b1[78]\d{17}\b": "NOW",
    r"(?m)^(NOW|1000000000005|0),\d+,(?=1000000000005|0,)": r"\1,N,",
}


@contextlib.contextmanager
def stage_for(transcript: str, master_uri: str) -> Iterator[None]:
    """Sets the stage that the first line of the transcript names: `stage: robot` or `stage: empty`."""
    if not transcript.startswith("stage: robot\n"):
        yield
        return
    stage = Stage(master_uri)
    try:
        yield
    finally:
        stage.close()


def wants_sources(transcript: str) -> bool:
    """True for `stage: sources`: a real node that publishes what `sources.py` tells."""
    return transcript.startswith("stage: sources\n")
