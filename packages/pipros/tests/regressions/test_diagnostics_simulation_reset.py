"""diagnostics: a component that died as the simulated time was set back stayed OK for the time so far."""

from __future__ import annotations

from pipros_libraries.diagnostics.aggregation import Aggregation
from pipros_libraries.diagnostics.items import OK, STALE, ComponentStatus


def test_a_component_that_is_silent_since_a_reset_is_stale() -> None:
    chosen = {"type": "GenericAnalyzer", "path": "A", "contains": ["dead", "alive"], "timeout": 5}
    aggregation = Aggregation("", {"a": chosen})
    for name in ("dead", "alive"):
        aggregation.take(ComponentStatus(name, OK, ""), 100.0)
    aggregation.take(ComponentStatus("alive", OK, ""), 2.0)
    levels = {each.name: each.level for each in aggregation.report(2.0)}
    assert (levels["/A/dead"], levels["/A/alive"]) == (STALE, OK)
