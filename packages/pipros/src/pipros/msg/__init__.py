"""Message and service definitions, and their classes: `from any_pkg.msg import Anything` without a build."""

from __future__ import annotations

TYPE_CHECKING = False  # Type checkers treat this as True. Importing `typing` would take milliseconds.
if TYPE_CHECKING:
    from typing import Any

    from pipros.msg.importing.load import load_message_class, load_service_class
    from pipros.msg.language.spec import DefinitionError

__all__ = ["DefinitionError", "load_message_class", "load_service_class"]


def __getattr__(name: str) -> Any:
    # These imports are lazy, because every interpreter start imports this package.
    if name == "DefinitionError":
        from pipros.msg.language.spec import DefinitionError

        return DefinitionError
    if name in __all__:
        from pipros.msg.importing import load

        return getattr(load, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
