"""The parameter `/run_id`, which identifies one run of a ROS system and also names the log folder."""

from __future__ import annotations

import re

from pipros.basics.printable import printable

# The id is used as the name of a folder next to the link `latest`, and any peer can set the parameter.
_RUN_ID = re.compile(r"[A-Za-z0-9_-]{1,64}")


def new_run_id() -> str:
    """Return a new, unique run id."""
    import uuid

    return str(uuid.uuid1())


def is_run_id(value: object) -> bool:
    """Return whether a value is a valid run id: up to 64 letters, digits, `_` and `-`, and not `latest`.

    >>> is_run_id("0fb2803c-e4ea-11f1-916a-02fc00000001"), is_run_id("../../etc")
    (True, False)
    """
    return isinstance(value, str) and value != "latest" and _RUN_ID.fullmatch(value) is not None


def run_id_problem(value: object, source: str) -> str:
    """Return the error text for a value rejected by `is_run_id`; `source` names its origin."""
    rule = "up to 64 letters, digits, _ and -" if value != "latest" else "an id other than latest"
    return f"{source} must be {rule}, got [{printable(value)}]"
