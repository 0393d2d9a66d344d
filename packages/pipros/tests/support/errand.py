"""A realistic package with state machines that use actions and services, and its expected output."""

from tests.support.patrol import PACKAGES

SOURCES = PACKAGES / "state_machines" / "src"
SAID = [
    "/ERRAND: ASK", "/ERRAND: DRIVE", "/ERRAND/DRIVE: MOVE,WATCH", "/ERRAND: ASK", "/ERRAND: DRIVE",
    "/ERRAND/DRIVE: MOVE,WATCH", "/ERRAND: ASK", "/ERRAND: DRIVE", "/ERRAND/DRIVE: MOVE,WATCH",
    "/ERRAND: COUNT", "/ERRAND: ASK", "/ERRAND: DRIVE", "/ERRAND/DRIVE: MOVE,WATCH", "/ERRAND: COUNT",
    "/ERRAND: failed", "failed after 2 tries, drive PREEMPTED",
]  # fmt: skip
