"""tf, as Noetic has it, on pipros.

`tf.transformations` needs numpy (`pip install 'pipros[numpy]'`) and is imported when it is first used.
"""

from typing import Any as _Any


def __getattr__(name: str) -> _Any:
    if name == "transformations":
        from importlib import import_module

        return import_module("tf.transformations")
    raise AttributeError(f"module 'tf' has no attribute '{name}'")
