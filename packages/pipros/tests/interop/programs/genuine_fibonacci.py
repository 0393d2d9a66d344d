"""Makes actionlib_tutorials/FibonacciAction, which Debian does not package, from its definition in a file."""

from pathlib import Path

import genpy.dynamic

KIND = "actionlib_tutorials/Fibonacci"


def load_fibonacci(file):
    """Return the class of the action, and that of its goal."""
    made = genpy.dynamic.generate_dynamic(f"{KIND}Action", Path(file).read_text())
    action = made[f"{KIND}Action"]
    return action, type(action().action_goal.goal)
