"""Functions shared by the examine_*.py scripts, independent of genuine ROS and pipros.

One JSON object a line: `{"label": ..., "result": ...}` or `{"label": ..., "error": [type, text]}`.
"""

import json
import threading


def examine(label, function):
    """Call the function, and print its outcome."""
    try:
        record = {"label": label, "result": repr(function())}
    except Exception as error:
        kind = ValueError if isinstance(error, ValueError) else type(error)
        record = {"label": label, "error": [kind.__name__, str(error)]}
    print("@@" + json.dumps(record), flush=True)


def begin(part):
    """Start a part, to which the following labels belong."""
    print("@@" + json.dumps({"label": f"-- {part}"}), flush=True)


def wait_for(condition):
    pause = threading.Event()
    for _ in range(6000):
        if condition():
            return
        pause.wait(0.01)
    raise SystemExit("what was waited for did not happen")
