"""A state, with its input and output data."""

import threading


class InvalidTransition(Exception):
    """A state returned an undeclared outcome, or one without a transition."""


class UserData:
    """Values as attributes, with one lock."""

    def __init__(self, **values):
        self.__dict__["_lock"] = threading.RLock()
        self.__dict__["_values"] = dict(values)

    def __getattr__(self, key):
        with self._lock:
            try:
                return self._values[key]
            except KeyError:
                raise AttributeError(key) from None

    def __setattr__(self, key, value):
        with self._lock:
            self._values[key] = value

    def items(self):
        with self._lock:
            return sorted(self._values.items())


class Remapped:
    """A state's view of its container's data, under its own names."""

    def __init__(self, data, inputs, outputs, names):
        self.__dict__.update(_data=data, _inputs=inputs, _outputs=outputs, _names=names)

    def __getattr__(self, key):
        if key not in self._inputs:
            raise AttributeError(f"{key} is not an input key")
        return getattr(self._data, self._names.get(key, key))

    def __setattr__(self, key, value):
        if key not in self._outputs:
            raise AttributeError(f"{key} is not an output key")
        setattr(self._data, self._names.get(key, key), value)


class State:
    """An activity that ends with one of its outcomes."""

    def __init__(self, outcomes=(), input_keys=(), output_keys=()):
        self.outcomes = set(outcomes)
        self.input_keys = set(input_keys)
        self.output_keys = set(output_keys)
        self._preempted = threading.Event()

    def execute(self, userdata):
        raise NotImplementedError

    def request_preempt(self):
        self._preempted.set()

    def service_preempt(self):
        self._preempted.clear()

    def preempt_requested(self):
        return self._preempted.is_set()
