"""States that consist of states: sequential or concurrent."""

import threading
import traceback

import rospy
from state_machines.states import InvalidTransition, Remapped, State, UserData


class Container(State):
    """States by label. `add` adds to the container of the enclosing `with` block."""

    opened = threading.local()

    def __init__(self, outcomes, input_keys=(), output_keys=()):
        State.__init__(self, outcomes, input_keys, output_keys)
        self.userdata = UserData()
        self.states = {}
        self.remappings = {}
        self.listeners = []

    def __enter__(self):
        if not hasattr(Container.opened, "stack"):
            Container.opened.stack = []
        Container.opened.stack.append(self)
        return self

    def __exit__(self, *_):
        Container.opened.stack.pop()

    @classmethod
    def current(cls):
        return Container.opened.stack[-1]

    def keep(self, label, state, remapping):
        if label in self.states:
            raise InvalidTransition(f"there are two states {label}")
        self.states[label] = state
        self.remappings[label] = remapping or {}

    def tell(self, active):
        for listener in self.listeners:
            listener(self, list(active))

    def run(self, label):
        state = self.states[label]
        data = Remapped(self.userdata, state.input_keys, state.output_keys, self.remappings[label])
        try:
            outcome = state.execute(data)
        except Exception:
            rospy.logerr("state %s raised:\n%s", label, traceback.format_exc())
            raise
        if outcome not in state.outcomes:
            raise InvalidTransition(f"state {label} has no outcome {outcome}")
        return outcome

    def fetch(self, parent):
        for key in self.input_keys:
            setattr(self.userdata, key, getattr(parent, key))

    def leave(self, parent):
        for key in self.output_keys:
            setattr(parent, key, getattr(self.userdata, key))

    def request_preempt(self):
        State.request_preempt(self)
        for state in list(self.states.values()):
            state.request_preempt()


class StateMachine(Container):
    """Sequential states, until a transition leads to an outcome."""

    def __init__(self, outcomes, input_keys=(), output_keys=()):
        Container.__init__(self, outcomes, input_keys, output_keys)
        self.transitions = {}
        self.initial = None

    @staticmethod
    def add(label, state, transitions=None, remapping=None):
        machine = Container.current()
        machine.keep(label, state, remapping)
        machine.transitions[label] = {outcome: outcome for outcome in state.outcomes}
        machine.transitions[label].update(transitions or {})
        machine.initial = machine.initial or label

    def check_consistency(self):
        known = set(self.states) | self.outcomes
        for label, transitions in self.transitions.items():
            lost = set(transitions.values()) - known
            if lost or set(transitions) - self.states[label].outcomes:
                raise InvalidTransition(f"transitions of {label} lead nowhere: {sorted(lost)}")

    def execute(self, parent=None):
        self.check_consistency()
        if parent is not None:
            self.fetch(parent)
        label = self.initial
        while label not in self.outcomes:
            if self.preempt_requested() and "preempted" in self.outcomes:
                self.service_preempt()
                label = "preempted"
                break
            self.tell([label])
            outcome = self.run(label)
            rospy.loginfo("%s -> %s -> %s", label, outcome, self.transitions[label][outcome])
            label = self.transitions[label][outcome]
        if parent is not None:
            self.leave(parent)
        self.tell([label])
        return label


class Concurrence(Container):
    """Concurrent states, each in a thread; a map of their outcomes determines the result."""

    def __init__(self, outcomes, default_outcome, outcome_map=None, child_termination_cb=None, **keys):
        Container.__init__(self, outcomes, **keys)
        self.default_outcome = default_outcome
        self.outcome_map = outcome_map or {}
        self.child_termination_cb = child_termination_cb
        self.ended = {}
        self.changed = threading.Condition()

    @staticmethod
    def add(label, state, remapping=None):
        Container.current().keep(label, state, remapping)

    def _run_one(self, label):
        outcome = None
        try:
            outcome = self.run(label)
        finally:
            with self.changed:
                self.ended[label] = outcome
                self.changed.notify_all()

    def execute(self, parent=None):
        if parent is not None:
            self.fetch(parent)
        self.ended = {}
        threads = [
            threading.Thread(target=self._run_one, args=(label,), daemon=True) for label in self.states
        ]
        self.tell(self.states)
        for thread in threads:
            thread.start()
        stopped = False
        with self.changed:
            while len(self.ended) < len(self.states) and not rospy.is_shutdown():
                enough = (
                    self.child_termination_cb and self.ended and self.child_termination_cb(dict(self.ended))
                )
                if enough and not stopped:
                    stopped = True
                    for label in set(self.states) - set(self.ended):
                        self.states[label].request_preempt()
                self.changed.wait(0.1)
        for thread in threads:
            thread.join()
        if parent is not None:
            self.leave(parent)
        for outcome, wanted in self.outcome_map.items():
            if all(self.ended.get(label) == value for label, value in wanted.items()):
                return outcome
        return self.default_outcome
