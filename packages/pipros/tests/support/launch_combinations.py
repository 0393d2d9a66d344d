"""The combinations of programs that launch files start most often, among those that pipros has.

`python -m tests.support.launch_combinations NODES.csv` counts them in a CSV file of
`roslaunch-check --csv`, and prints the list that `launch_combinations.txt` in `tests.graph` holds: the number
of files, then the programs and nodelets. Windows and commands are left out, because they publish nothing by
themselves.
"""

import sys
from collections import Counter, defaultdict

from pipros_tools.launch.survey import Owner, Providers, read_csv
from pipros_workspace.index import SHIPPED_FOLDERS, PackageIndex
from tests.support.environments import file_of_tests

LIST = file_of_tests("graph/launch_combinations.txt")
COUNT = 60

WINDOWS_AND_COMMANDS = {
    "dynamic_reconfigure/dynparam", "image_view/disparity_view", "image_view/image_view",
    "joint_state_publisher_gui/joint_state_publisher_gui", "rosbag/play", "rosbag/record",
    "rosservice/rosservice", "rostopic/rostopic", "rviz/rviz",
    "teleop_twist_keyboard/teleop_twist_keyboard.py",
}  # fmt: skip


def combinations() -> list[tuple[str, ...]]:
    """Return the programs of each combination in the list."""
    return [tuple(line.split()[1:]) for line in LIST.read_text(encoding="utf-8").splitlines()]


def counted(path: str) -> list[str]:
    """Return the lines of the list for a CSV file."""
    providers = Providers(PackageIndex(SHIPPED_FOLDERS))
    programs: dict[str, set[str]] = defaultdict(set)
    for use in read_csv(path):
        is_quiet = use.name in WINDOWS_AND_COMMANDS or use.package.startswith("rqt_")
        if use.element == "node" and not is_quiet and providers.owner(use) is Owner.SHIPPED:
            programs[use.file].add(use.name)
    counts = Counter(tuple(sorted(names)) for names in programs.values())
    ranked = sorted(counts, key=lambda names: (-counts[names], names))
    return [f"{counts[names]} {' '.join(names)}" for names in ranked[:COUNT]]


if __name__ == "__main__":
    print("\n".join(counted(sys.argv[1])))
