#!/usr/bin/env python3
"""Processor time of the operations of navigation, and of the bare numpy operation beside each.

    benchmarks/navigation.py [--repetitions 500]

The median of all repetitions counts. Other programs hardly disturb it: only the processor time of this
process is measured, in one thread.
"""

import argparse
import os
import statistics
import time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from pipros.navigation.filter.kalman import ExtendedKalmanFilter
from pipros.navigation.filter.state import SIZE, Measurement
from pipros.navigation.filter.unscented import UnscentedKalmanFilter


def median_ms(work, repetitions):
    """Return the median processor time of `work()` in milliseconds."""
    taken = []
    for _ in range(repetitions):
        began = time.process_time_ns()
        work()
        taken.append((time.process_time_ns() - began) / 1e6)
    return statistics.median(taken)


def filter_step(kalman):
    """Return a function that predicts by 33 ms and corrects with 12 variables."""
    flags = np.zeros(SIZE, bool)
    flags[:12] = True
    values = np.random.default_rng(1).normal(0.0, 0.1, SIZE)
    measurement = Measurement("odom0", 0.0, values, np.eye(SIZE) * 0.1, flags)

    def step():
        kalman.predict(0.0, 0.033)
        kalman.correct(measurement)

    return step


def filter_products():
    """The products and the inverse of such a step, without anything around them."""
    square, part = np.eye(SIZE) * 0.5, np.eye(12) * 0.5

    def step():
        square @ square @ square.T
        np.linalg.inv(part)
        square @ square @ square.T

    return step


OPERATIONS = {
    "EKF, one step with 12 variables": (lambda: filter_step(ExtendedKalmanFilter()), filter_products),
    "UKF, one step with 12 variables": (
        lambda: filter_step(UnscentedKalmanFilter(alpha=1.0)),
        filter_products,
    ),
}


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--repetitions", type=int, default=500)
    repetitions = parser.parse_args().repetitions
    print("| operation | time | numpy alone |")
    print("| --- | ---: | ---: |")
    for name, (operation, bare) in OPERATIONS.items():
        times = [median_ms(make(), repetitions) for make in (operation, bare)]
        print(f"| {name} | {times[0]:.3f} ms | {times[1]:.3f} ms |")


if __name__ == "__main__":
    main()
