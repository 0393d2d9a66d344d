"""The example of docs/fleets.md."""

from __future__ import annotations

import re

from pipros.fleet.fleet_file import parse_fleet_file
from tests.support.environments import REPOSITORY

DOCUMENT = (REPOSITORY / "docs" / "fleets.md").read_text()


def test_the_file_is_valid() -> None:
    (example,) = re.findall(r"^```yaml\n(.*?)^```", DOCUMENT, re.MULTILINE | re.DOTALL)

    file = parse_fleet_file(example, "docs/fleets.md")

    assert file.router == "tls/fleet.example.org:7447"
