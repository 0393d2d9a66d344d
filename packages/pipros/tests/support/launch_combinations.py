"""The combinations of programs that launch files start most often, among those that pipros has."""

from tests.support.environments import file_of_tests

LIST = file_of_tests("graph/launch_combinations.txt")
"""The number of files with each combination, then its programs and nodelets.

They were counted in a CSV file of `roslaunch-check --csv`. Windows and commands are left out, because they
publish nothing by themselves.
"""
COUNT = 60


def combinations() -> list[tuple[str, ...]]:
    """Return the programs of each combination in the list."""
    return [tuple(line.split()[1:]) for line in LIST.read_text(encoding="utf-8").splitlines()]
