"""Interface definitions and message objects: `from any_pkg.msg import Anything` without a build."""

from __future__ import annotations

TYPE_CHECKING = False  # as type checkers see it; `typing` itself would take milliseconds
if TYPE_CHECKING:
    from typing import Any

    from pipros.msg.load import load_message_class, load_service_class
    from pipros.msg.spec import DefinitionError

__all__ = ["DefinitionError", "load_message_class", "load_service_class"]


def __getattr__(name: str) -> Any:
    # Imported late: this package lies on the way of every interpreter start.
    if name == "DefinitionError":
        from pipros.msg.spec import DefinitionError

        return DefinitionError
    if name in __all__:
        from pipros.msg import load

        return getattr(load, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
