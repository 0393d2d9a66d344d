#!/usr/bin/env python3
"""How well maps of slam_gmapping in pipros and in genuine ROS match the apartment, after the same drives.

    benchmarks/maps_beside_genuine.py [--seeds 5] [--first 0]

Both nodes have 30 particles, and get the same scans and transforms from a drive of 30 m with 2 % noise in the
odometry: a scan every 0.3 m or 0.2 rad, each of which is processed. It needs genuine ROS 1 and the compiled
nodes; see tests/interop. "Near walls" is the share of occupied cells at most one cell from a wall; IoU is the
number of cells that are free in both the map and the apartment, divided by the number free in either.
"""

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from navigation_beside_genuine import system

from tests.interop import test_gmapping_as_genuine as gmapping
from tests.support.both_navigation import SIDES, both_nodes
from tests.support.drives import apart, drive

NOISE = {"srr": 0.02, "srt": 0.04, "str": 0.02, "stt": 0.04}


def judged(ros, seed):
    """Return the agreement of both maps."""
    parameters = gmapping.PARAMETERS | NOISE | {"particles": 30, "seed": seed}
    moments = apart(drive(start=gmapping.BEGIN, noise=0.02, seed=seed), 0.3, 0.2)
    with both_nodes(ros, "gmapping", "slam_gmapping", parameters, remaps=["scan:=/scan"]) as both:
        maps = gmapping.drawn(both, moments)
    return [gmapping.judged(maps[side].messages[-1]) for side in SIDES]


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--first", type=int, default=0)
    given = parser.parse_args()
    print("| seed | near walls: pipros | genuine | IoU: pipros | genuine |")
    print("| ---: | ---: | ---: | ---: | ---: |")
    for seed in range(given.first, given.first + given.seeds):
        with system() as ros:
            ours, theirs = judged(ros, seed)
        near, free = (
            f"{ours.walls_near:.1%} | {theirs.walls_near:.1%}",
            f"{ours.free_iou:.3f} | {theirs.free_iou:.3f}",
        )
        print(f"| {seed} | {near} | {free} |", flush=True)


if __name__ == "__main__":
    main()
