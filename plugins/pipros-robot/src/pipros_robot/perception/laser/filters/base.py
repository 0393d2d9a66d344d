"""The base class of all scan filters, and typed access to their parameters."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from pipros.basics.errors import PiprosError
from pipros_libraries.nodes.params import converted, read
from pipros_libraries.reconfiguring.server import Setting
from pipros_libraries.transforms.listener import TransformListener
from pipros_robot.perception.laser.scan import Scan


class InvalidFilter(PiprosError, ValueError):
    """The description of a filter or chain is invalid. The text names the filter and the problem."""


class FilterFailed(PiprosError):
    """A filter cannot process a scan. The text says why."""


class FilterHost:
    """The parts of a node that filters use. Tests without transforms omit the listener."""

    def __init__(self, listener: TransformListener | None = None) -> None:
        self._listener = listener

    @property
    def listener(self) -> TransformListener:
        """The node's transform listener.

        Raises:
            FilterFailed: the node has no transforms.
        """
        if self._listener is None:
            raise FilterFailed("this filter needs a node with transforms")
        return self._listener


class ScanFilter:
    """A filter for scans.

    Attributes:
        settings: parameters with their defaults. Clients can change them if `is_reconfigurable` is true.
        fixed: parameters that clients cannot change.
        required: names of the required parameters.
        from_server: names of settings that are read from the filter's namespace on the parameter server.
            Their values in a chain's description have no effect.
        values: the current parameters by name. The mapping is replaced when a client changes them.
    """

    settings: ClassVar[tuple[Setting, ...]] = ()
    fixed: ClassVar[tuple[Setting, ...]] = ()
    required: ClassVar[tuple[str, ...]] = ()
    from_server: ClassVar[tuple[str, ...]] = ()
    is_reconfigurable: ClassVar[bool] = False

    def __init__(self, name: str, params: Mapping[str, Any], place: FilterHost) -> None:
        """Read the parameters.

        Raises:
            InvalidFilter: a parameter is missing or invalid.
        """
        self.name, self.place = name, place
        self.values: Mapping[str, Any] = {
            each.name: read(params.get(each.name), each.default) for each in (*self.settings, *self.fixed)
        }
        for each in self.required:
            if converted(params.get(each), type(self._default(each))) is None:
                kind = type(self._default(each)).__name__
                raise InvalidFilter(
                    f"filter {name}: parameter {each} must be of type {kind}, got {params.get(each)!r}"
                )
        self.read(params)

    def read(self, params: Mapping[str, Any]) -> None:
        """Read parameters that are not settings. Subclasses may override this method."""

    def changed(self) -> None:
        """Handle changes that a client has made to `values`. Subclasses may override this method."""

    def update(self, scan: Scan) -> Scan:
        """Return the filtered scan.

        Raises:
            FilterFailed: the filter cannot process the scan.
        """
        raise NotImplementedError

    def _default(self, name: str) -> Any:
        described = (*self.settings, *self.fixed)
        return next((each.default for each in described if each.name == name), 0.0)
