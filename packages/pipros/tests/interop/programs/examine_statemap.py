"""Call smclib.statemap in a random order, and print the results: examine_statemap.py SEED."""

import io
import random
import sys

from smclib import statemap

chance = random.Random(int(sys.argv[1]))  # noqa: S311
states = [statemap.State(f"S{number}", number) for number in range(4)]
stream = io.StringIO()
machine = statemap.FSMContext(states[0])
print(machine.getDebugFlag(), machine.getDebugStream() is sys.stderr, machine.getTransition())
machine.setDebugStream(stream)
print(machine.getDebugStream() is stream, issubclass(statemap.StateUndefinedException, Exception))
print(statemap.TransitionUndefinedException.__mro__[1:])
calls = [
    lambda: machine.setState(chance.choice(states)), lambda: machine.pushState(chance.choice(states)),
    lambda: machine.pushState("no state"), lambda: machine.setState(None), machine.popState,
    machine.clearState, lambda: machine.setDebugFlag(chance.random() < 0.7), machine.isInTransition,
    machine.isStateStackEmpty, machine.getStateStackDepth, lambda: machine.getState().getName(),
    lambda: machine.getState().getId(),
    lambda: machine.getPreviousState() and machine.getPreviousState().getName(),
    lambda: chance.random() < 0.2 and machine.emptyStateStack(),
]  # fmt: skip
for _ in range(400):
    number = chance.randrange(len(calls))
    try:
        print(number, calls[number]())
    except Exception as error:
        print(number, type(error).__name__, error)
print(stream.getvalue())
