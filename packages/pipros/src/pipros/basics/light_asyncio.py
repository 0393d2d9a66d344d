"""Import asyncio without `ssl`, which takes a sixth of `import rospy`, and which few nodes use.

While asyncio is imported here, its modules find stand-ins for `ssl` and `asyncio.sslproto`. Each imports its
module when asyncio first uses it, for example for `asyncio.open_connection(..., ssl=True)`. Afterwards,
`import ssl` and `import asyncio.sslproto` import the modules as usual. Nothing changes if a program has
imported asyncio or `ssl` before.
"""

from __future__ import annotations

import sys
from importlib import import_module

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

_modules: dict[str, Any] = sys.modules
_NAMES = ("ssl", "asyncio.sslproto")


class _StandIn:
    """A module that is imported when one of its attributes is first used."""

    __spec__ = None  # looked up by `import`

    def __init__(self, name: str) -> None:
        self._name = name

    def __getattr__(self, attribute: str) -> Any:
        if attribute == "SSLSocket" and "ssl" not in _modules:
            return ()  # for isinstance: asyncio refuses such sockets, and there are none yet
        if _modules.get(self._name) is self:
            del _modules[self._name]
        return getattr(import_module(self._name), attribute)


def _import_asyncio() -> None:
    if "asyncio" in _modules or "ssl" in _modules:
        return
    stand_ins = {name: _StandIn(name) for name in _NAMES}
    _modules.update(stand_ins)
    try:
        asyncio: Any = import_module("asyncio")
        asyncio.sslproto = stand_ins["asyncio.sslproto"]
    finally:
        for name, stand_in in stand_ins.items():
            if _modules.get(name) is stand_in:
                del _modules[name]


_import_asyncio()
