"""Evaluate expressions with genpy's Time and Duration, to compare implementations.

Run as a script by either Python: reads a JSON list of expressions, and prints their outcomes.
"""

import copy
import json
import pickle
import random
import sys

NAMES = {"copy": copy, "pickle": pickle, "nan": float("nan"), "inf": float("inf")}

CONSTRUCTION = """
T() T(1) T(1,2) T(1.5) T(1.5,5) T(1.5,0) T(-1) T(-1,5) T(1,-5) T(0,-5)
T(1,1500000000) T(1,-1500000000) T('a')
T(None) T(1,'a') T(1,2.5) T(True) T(1,None) D() D(-1) D(-1.5) D(1,-5) D(-1,-5) D(1.5,5) D('a') V()
V(-1.5) V(1,-5) V(1.5,3) T(1e20) T(nan) T(inf) T(secs=3,nsecs=4) D(nsecs=4) T.from_sec(1.5) T.from_sec(-1.5)
D.from_sec(-1.5) V.from_sec(1.5) T.from_sec(0.1) T.from_sec(1234567890.123456789) T.from_sec(3)
T.from_sec('1') D.from_sec(1e-9) D.from_sec(None) T.from_sec(0.9999999999) S(2) R(2) R.from_sec(1.5)
"""
VALUES = ["T(1,5)", "T(2)", "D(1,5)", "D(-1,5)", "D(3)", "D(-5,3)", "D()", "V(1)", "S(2,7)", "R(3)"]
OTHERS = ["1", "2.5", "-3", "0", "'a'", "None", "True"]
METHODS = ["to_sec()", "to_nsec()", "to_time()", "is_zero()", "secs", "nsecs", "__nonzero__()", "foo"]
METHODS += ["__getstate__()", "_slot_types"]
COPY_BY_PICKLE = "pickle.loads(pickle.dumps({}))"
OPERATORS = ["+", "-", "*", "/", "//", "%", "==", "!=", "<", "<=", ">", ">="]


def expressions(seed, count):
    """Return expressions: all constructors, all operators on all values, and random durations."""
    found = CONSTRUCTION.split()
    found += [f"{value}.{method}" for value in VALUES[:7] for method in METHODS]
    pairs = [(left, right) for left in VALUES for right in VALUES + OTHERS]
    pairs += [(left, right) for left in OTHERS for right in VALUES]
    found += [f"{left} {sign} {right}" for left, right in pairs for sign in OPERATORS]
    for form in ["-{}", "abs({})", "bool({})", "str({})", "hash({})", "copy.copy({})", COPY_BY_PICKLE]:
        found += [form.format(value) for value in VALUES[:8]]
    found += [f"divmod({left}, {right})" for left in VALUES for right in VALUES + OTHERS]
    rng = random.Random(seed)  # noqa: S311
    for _ in range(count):
        left, right = (f"D({rng.randint(-(10**6), 10**6)}, {rng.randint(0, 10**9)})" for _ in range(2))
        number = rng.choice([rng.randint(-9, 9), rng.uniform(-9, 9)])
        found.append(f"{left} {rng.choice(['+', '-', '/', '//', '%'])} {right}")
        found.append(f"{left} {rng.choice(['*', '/', '//'])} {number}")
    return found


def outcome(expression, genpy):
    class S(genpy.Duration):
        __slots__ = []

    class R(genpy.Time):
        __slots__ = []

    names = {**NAMES, "T": genpy.Time, "D": genpy.Duration, "V": genpy.TVal, "S": S, "R": R}
    try:
        value = eval(expression, names)  # noqa: S307 # the expressions are those above
    except Exception as error:
        return [type(error).__name__, str(error)]
    return [type(value).__name__, repr(value)]


if __name__ == "__main__":
    import genpy

    json.dump([outcome(expression, genpy) for expression in json.load(sys.stdin)], sys.stdout)
