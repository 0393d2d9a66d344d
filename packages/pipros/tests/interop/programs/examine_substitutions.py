"""Resolve each line of a file with `roslaunch.substitution_args`, and print the outcomes as JSON lines.

The arguments are those of the context below. Knows neither genuine ROS nor pipros.
"""

import json
import sys

from roslaunch.substitution_args import resolve_args

ARGUMENTS = {
    "a": "3", "b": "true", "s": "hi there", "n": "-1.5", "empty": "", "path": "/x/y.bag", "numbers": "[1, 2]",
}  # fmt: skip

with open(sys.argv[1]) as file:
    texts = file.read().splitlines()
for line in texts:
    try:
        outcome = {
            "result": resolve_args(line, context={"arg": dict(ARGUMENTS), "filename": "/launch/x.launch"})
        }
    except Exception as error:
        outcome = {"error": type(error).__name__}
    print(json.dumps(outcome))
