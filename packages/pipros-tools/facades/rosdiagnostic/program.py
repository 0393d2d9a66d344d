"""`rosrun rosdiagnostic rosdiagnostic`: print the statuses on a diagnostics topic once."""

from __future__ import annotations

import argparse
import sys
from typing import Any

import rospy
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros.msg import load_message_class
from pipros_libraries.diagnostics.items import LEVEL_NAMES, ComponentStatus
from pipros_libraries.diagnostics.listing import listed

_LEVELS = [name.lower() for name in LEVEL_NAMES]


@exits_after_ctrl_c(130)
def main() -> int:
    """Print one array of statuses. Return the exit code, which is 1 if no array arrives in time."""
    parser = argparse.ArgumentParser("rosdiagnostic", description="Prints the newest diagnostics.")
    parser.add_argument(
        "name", nargs="?", default="", help="show only statuses whose name contains this text"
    )
    parser.add_argument("-t", "--topic", default="/diagnostics_agg", help="default: /diagnostics_agg")
    parser.add_argument("-l", "--level", choices=_LEVELS, default="ok", help="show only this level and worse")
    parser.add_argument("-d", "--details", action="store_true", help="also show the values")
    parser.add_argument(
        "-w",
        "--wait",
        type=float,
        default=5.0,
        metavar="S",
        help="seconds to wait for a message (default: 5)",
    )
    options = parser.parse_args(rospy.myargv()[1:])
    rospy.init_node("rosdiagnostic", anonymous=True)
    kind: Any = load_message_class("diagnostic_msgs/DiagnosticArray")
    try:
        array = rospy.wait_for_message(options.topic, kind, timeout=options.wait)
    except rospy.ROSInterruptException:
        return 130
    except rospy.ROSException:
        print(
            f"ERROR: no message on {options.topic} within {options.wait:g} s; /diagnostics_agg needs an "
            "aggregator (rosrun diagnostic_aggregator aggregator_node), -t /diagnostics does not",
            file=sys.stderr,
        )
        return 1
    statuses = [
        ComponentStatus(
            item.name,
            item.level,
            item.message,
            item.hardware_id,
            [(pair.key, pair.value) for pair in item.values],
        )
        for item in array.status
    ]
    least = _LEVELS.index(options.level)
    for line in listed(statuses, least=least, part=options.name, details=options.details):
        print(line)
    return 0
