#!/usr/bin/env python3
"""Write types.json: the results of genuine genpy for every type included in pipros.

    python -m tests.golden.messages.record      # in the project's folder, with genuine ROS installed

Long bytes and texts are stored as digests. The values depend on a seed (see examine_messages.py): the name of
the type, so that a new type does not change the values of others.
Definitions are stored without their comments, which may be rewritten at any time.
"""

from __future__ import annotations

import hashlib
import json
import re
from pathlib import Path
from typing import Any

from pipros.msg import load_message_class, load_service_class
from pipros.msg.importing.hook import installed_library
from tests.interop.programs.examine_messages import ask_genuine
from tests.support.environments import SHIPPED

FILE = Path(__file__).with_name("types.json")
LONGEST = 120
_STRING_CONSTANT = re.compile(r"\s*string [^#]*=")


def jobs() -> list[dict[str, Any]]:
    """Return a job with random values for each message and each half of each service included."""
    files = installed_library().files
    found: list[dict[str, Any]] = []
    for package in sorted(folder.name for share in SHIPPED for folder in share.iterdir()):
        for name in files.names("msg", package):
            cls = load_message_class(f"{package}/{name}")
            found.append({"type": cls._type, "text": cls._full_text})
        for name in files.names("srv", package):
            service = load_service_class(f"{package}/{name}")
            for half in (service._request_class, service._response_class):
                found.append({"type": half._type, "text": half._full_text, "service": service._type})
    return [{**job, "seed": job["type"], "count": 3} for job in found]


def recorded(answer: dict[str, Any]) -> dict[str, Any]:
    """Return the recorded part of an answer."""
    return {key: shortened(value) for key, value in {**answer, "text": bare(answer["text"])}.items()}


def bare(text: str) -> str:
    """A full text without comments and empty lines."""
    lines = (line if _STRING_CONSTANT.match(line) else line.partition("#")[0] for line in text.split("\n"))
    return "\n".join(line.strip() for line in lines if line.strip())


def shortened(answer: Any) -> Any:
    if isinstance(answer, str) and len(answer) > LONGEST:
        return "sha256 " + hashlib.sha256(answer.encode()).hexdigest()
    if isinstance(answer, dict):
        return {key: shortened(value) for key, value in answer.items()}
    if isinstance(answer, list):
        whole = json.dumps(answer)
        if len(whole) > 20 * LONGEST:
            return shortened(whole)
        return [shortened(value) for value in answer]
    return answer


def main() -> None:
    asked = jobs()
    golden = {job["type"]: recorded(answer) for job, answer in zip(asked, ask_genuine(asked), strict=True)}
    lines = [f"{json.dumps(kind)}: {json.dumps(golden[kind])}" for kind in sorted(golden)]
    FILE.write_text("{\n" + ",\n".join(lines) + "\n}\n")


if __name__ == "__main__":
    main()
