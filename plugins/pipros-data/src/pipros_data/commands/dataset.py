"""`pipros dataset`: makes data sets from bags."""

from __future__ import annotations

import os
import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from pathlib import Path

from pipros.basics.errors import MissingExtra, PiprosError
from pipros_tools.cli.entry_point import command
from pipros_tools.cli.rosbag.other_bags import warned


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Make a data set, suggest a description, or run a node that marks episodes.

    Return the exit code: 1 after an error, or if no episode was written.
    """
    parser = ArgumentParser(
        prog="pipros dataset",
        description="Writes episodes at a constant rate, as described in robot.yaml. Repeat the command to "
        "continue after an interruption. OUT/report.md contains the findings of the checks.",
    )
    parser.add_argument("bags", nargs="*", metavar="BAG", help="bags, or patterns such as 'run*.bag'")
    parser.add_argument("--suggest", action="store_true", help="print a first description of the topics")
    parser.add_argument(
        "--marker", metavar="TOPIC", help="run a node whose services TOPIC/start and TOPIC/stop mark episodes"
    )
    parser.add_argument("--config", type=Path, metavar="FILE", help="the description: robot.yaml")
    parser.add_argument("-o", "--output", type=Path, metavar="OUT", help="the folder of the data set")
    parser.add_argument("--format", default="parquet", choices=("hdf5", "lerobot", "parquet"))
    parser.add_argument(
        "-j", "--jobs", type=int, metavar="N", default=os.cpu_count() or 1, help="number of processes"
    )
    parser.add_argument(
        "--msgs", action="append", default=[], metavar="FOLDER", help="a folder with ROS 2 definitions"
    )
    parser.add_argument("-q", "--quiet", action="store_true", help="show no progress")
    chosen = parser.parse_args(argv)
    if not chosen.bags and not chosen.marker:
        parser.error("a bag is required")
    if not (chosen.suggest or chosen.marker or (chosen.config and chosen.output)):
        parser.error("--config and -o are required. --suggest prints a first description")
    if chosen.jobs < 1:
        parser.error(f"--jobs must be >= 1, got {chosen.jobs}")
    try:
        return (_mark if chosen.marker else _suggest if chosen.suggest else _build)(chosen)
    except FileNotFoundError as error:
        print(f"pipros dataset: no such file: {error.filename}", file=sys.stderr)
    except (PiprosError, MissingExtra, OSError) as error:
        print(f"pipros dataset: {error}", file=sys.stderr)
    return 1


def _suggest(chosen: Namespace) -> int:
    from pipros_data import open_bags
    from pipros_data.datasets.suggest import suggest

    with open_bags(*chosen.bags, msgs=chosen.msgs) as bags:
        print(suggest(bags), end="")
    return 0


def _mark(chosen: Namespace) -> int:
    from pipros.node.roscpp_program import roscpp_program
    from pipros_data.datasets.marker import EpisodeMarker

    with roscpp_program("episode_marker", "dataset", []) as (node, _):
        EpisodeMarker(node, chosen.marker)
        node.wait_for_shutdown()
    return 0


def _build(chosen: Namespace) -> int:
    from pipros_data.datasets.build import build
    from pipros_data.datasets.config import read_config
    from pipros_data.opening import matching_files

    config = read_config(chosen.config)
    bags = [name for each in chosen.bags for name in matching_files(each)]
    is_shown = sys.stdout.isatty() and not chosen.quiet

    def shown(done: int, total: int) -> None:
        if is_shown:
            print(f"\r {done} of {total} episodes", end="\n" if done == total else "", flush=True)

    left_out = warned()
    options = {"jobs": chosen.jobs, "msgs": chosen.msgs, "shown": shown, "left_out": left_out.whole}
    results = build(bags, config, chosen.output, chosen.format, **options)
    written = [each for each in results if not each["left_out"]]
    for each in [each for each in results if each["left_out"]][:3]:
        print(f"{each['bag']}: left out: {each['left_out']}", file=sys.stderr)
    rows, findings = (sum(each["rows"] for each in written), sum(len(each["findings"]) for each in results))
    print(f"{len(written)} of {len(results)} episodes, {rows} rows, {findings} findings: ", end="")
    print(chosen.output / "report.md")
    for each in results:
        for text in each.get("bad_messages", ())[:1]:
            left_out.whole(f"{each['bag']}: a message", text)
    return 0 if written and not left_out else 1
