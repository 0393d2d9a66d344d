"""The example of docs/guides/fleets.md."""

from __future__ import annotations

import re

from pipros_fleet.fleet_file import parse_fleet_file
from tests.support import documents

DOCUMENT = documents.text_of("guides/fleets.md")


def test_the_file_is_valid() -> None:
    (example,) = re.findall(r"^```yaml\n(.*?)^```", DOCUMENT, re.MULTILINE | re.DOTALL)

    file = parse_fleet_file(example, "plugins/pipros-fleet/docs/guides/fleets.md")

    assert file.router == "tls/router.lan:7447"
