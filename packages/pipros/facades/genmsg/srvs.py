"""`genmsg.srvs`: service definitions as genmsg objects."""

from __future__ import annotations

from genmsg.base import SEP
from genmsg.msgs import MsgSpec
from genmsg.names import (
    is_legal_resource_base_name,
    is_legal_resource_name,
    package_resource_name,
    resource_name,
)
from pipros.msg.language.spec import ServiceSpec

__all__ = [
    "SEP",
    "MsgSpec",
    "SrvSpec",
    "is_legal_resource_base_name",
    "is_legal_resource_name",
    "package_resource_name",
    "resource_name",
]


class SrvSpec:
    """A service definition, which consists of a request and a response."""

    def __init__(
        self,
        request: MsgSpec,
        response: MsgSpec,
        text: str,
        full_name: str = "",
        short_name: str = "",
        package: str = "",
    ) -> None:
        self.request = request
        self.response = response
        self.text = text
        self.full_name = full_name
        self.short_name = short_name or full_name.partition(SEP)[2]
        self.package = package or full_name.partition(SEP)[0]

    @classmethod
    def of(cls, spec: ServiceSpec) -> SrvSpec:
        return cls(MsgSpec.of(spec.request), MsgSpec.of(spec.response), spec.text, spec.type)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, SrvSpec):
            return False
        mine = (self.request, self.response, self.text, self.full_name, self.short_name, self.package)
        names = (other.full_name, other.short_name, other.package)
        return mine == (other.request, other.response, other.text, *names)

    def __ne__(self, other: object) -> bool:
        return not self == other

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"SrvSpec[{self.request!r}, {self.response!r}]"
