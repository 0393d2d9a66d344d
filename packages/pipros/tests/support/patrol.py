"""A realistic package with actions and transforms, and its expected output."""

from tests.support.environments import file_of_tests

PACKAGES = file_of_tests("packages")
SAID = [
    "(2.0, 0.0): SUCCEEDED there", "  at 2.00 0.00, 2.00 0.00, nose at 3.00 0.00",
    "(2.0, 3.0): SUCCEEDED there", "  at 2.00 3.00, 2.00 3.00, nose at 2.00 4.00",
    "(-1.0, 0.0): ABORTED there is a wall", "moved: True", "cancelled: PREEMPTED stopped",
]  # fmt: skip
