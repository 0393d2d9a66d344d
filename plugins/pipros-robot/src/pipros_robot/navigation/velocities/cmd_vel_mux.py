"""Select one source of velocity commands by priorities, as yocs_cmd_vel_mux 0.8 does.

The active source stays in control until it expires, or until a source with a higher priority sends a
velocity.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from pipros.basics import names
from pipros.safe import yaml
from pipros_libraries.teleoperation.velocity_mux import InvalidSource, VelocitySource, sources

OUTPUT = "output"
"""The default output topic."""


def read_sources(text: str, report: Callable[[str], object]) -> tuple[list[VelocitySource], str]:
    """Return the sources and the output topic of a configuration in YAML. Report each invalid source.

    Raises:
        PiprosError: the text is not YAML, is not a mapping, or has no valid source or output.
    """
    found = yaml.load(text)
    if not isinstance(found, dict):
        raise InvalidSource("it must be a mapping with `subscribers` and `publisher`")
    output = found.get("publisher", OUTPUT)
    if not isinstance(output, str) or not output or not names.is_legal(output):
        raise InvalidSource(f"publisher must be the name of a topic, got {output!r}")
    inputs = []
    for each in sources(found.get("subscribers"), "subscribers", report):
        if each.timeout_s > 0:
            inputs.append(each)
        else:
            report(f"subscribers: the timeout of {each.name!r} must be > 0, got {each.timeout_s:g}")
    if not inputs:
        raise InvalidSource("`subscribers` has no valid source")
    return inputs, output


class CmdVelMux:
    """Selects the source whose velocities are forwarded. The caller provides the time.

    Attributes:
        active: the source in control, or None.
    """

    def __init__(self) -> None:
        self.active: VelocitySource | None = None
        self._inputs: Sequence[VelocitySource] = ()

    def replace(self, inputs: Sequence[VelocitySource]) -> None:
        """Replace the sources. A source that keeps its name stays active."""
        received_s = {each.name: each.received_s for each in self._inputs}
        for each in inputs:
            each.received_s = received_s.get(each.name, 0.0)
        active = self.active.name if self.active else None
        self._inputs, self.active = inputs, next((each for each in inputs if each.name == active), None)

    def passes(self, one: VelocitySource, now_s: float) -> bool:
        """Record the arrival of a velocity from a source. Return whether to forward it."""
        one.received_s = now_s
        self.expire(now_s)
        if self.active is None or one.priority > self.active.priority:
            self.active = one
        return self.active is one

    def expire(self, now_s: float) -> bool:
        """Take control from an expired source. Return whether no source is about to take it."""
        if self.active and self.active.is_expired(now_s):
            self.active = None
        return self.active is None and not any(each.speaks(now_s) for each in self._inputs)
