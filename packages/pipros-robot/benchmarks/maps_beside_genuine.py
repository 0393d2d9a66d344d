#!/usr/bin/env python3
"""How well maps of slam_gmapping in pipros match the apartment, beside recorded maps of the genuine node.

    benchmarks/maps_beside_genuine.py [SEED...]

The node has 30 particles, and gets the scans and transforms of a drive of 30 m with 2 % noise in the
odometry: a scan every 0.3 m or 0.2 rad, each of which is processed. The genuine node got the same, and drew
three maps for each of the seeds 0 to 4 (benchmarks/recorded); their mean, least and greatest figures are
printed. "Near walls" is the share of occupied cells at most one cell from a wall; IoU is the number of cells
that are free in both the map and the apartment, divided by the number free in either.
"""

import statistics
import sys

import numpy as np
from navigation_bench import MAPPING, MAPPING_START, drawn, recorded, running

from tests.support.drives import agreement, apart, drive

NOISE = {"srr": 0.02, "srt": 0.04, "str": 0.02, "stt": 0.04}


def mapped(seed, before):
    """Return the agreement of pipros's map after the drive of a recorded seed."""
    parameters = MAPPING | NOISE | {"particles": 30, "seed": seed}
    moments = list(apart(drive(start=MAPPING_START, noise=0.02, seed=seed), 0.3, 0.2))
    if (parameters, len(moments)) != (before["parameters"], before["moments"]):
        raise SystemExit(f"the recording of seed {seed} is of another drive: {before['moments']} scans")
    with running() as bench:
        last = drawn(bench, moments, parameters)[-1]
    cells = np.array(last.data, np.int8).reshape(last.info.height, last.info.width)
    return agreement(cells, (last.info.origin.position.x, last.info.origin.position.y), MAPPING_START)


def shown(ours, theirs, form):
    figures = statistics.mean(theirs), min(theirs), max(theirs)
    mean, least, greatest = (format(each, form) for each in figures)
    return f"{ours:{form}} | {mean} ({least} to {greatest})"


def main(*chosen):
    seeds = recorded("maps_beside_genuine")["seeds"]
    print("| seed | near walls: pipros | genuine | IoU: pipros | genuine |")
    print("| ---: | ---: | ---: | ---: | ---: |")
    for seed in chosen or seeds:
        ours = mapped(int(seed), seeds[seed])
        theirs = [run["agreement"] for run in seeds[seed]["runs"]]
        near = shown(ours.walls_near, [each["walls_near"] for each in theirs], ".1%")
        free = shown(ours.free_iou, [each["free_iou"] for each in theirs], ".3f")
        print(f"| {seed} | {near} | {free} |", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
