"""`genpy.generate_initpy`: the `__init__.py` files for folders of generated modules."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from genmsg import MsgGenerationException as MsgGenerationException
from pipros.basics.lazy_names import star_names as _star_names

_star_names(__name__, "os")


def write_modules(outdir: str) -> int:
    """Write the `__init__.py` for a folder that contains generated modules called `_Name.py`. Return 0.

    Raises:
        OSError: the folder cannot be read or written.
    """
    write_module(outdir, sorted(file.stem for file in Path(outdir).glob("_[!_]*.py")))
    return 0


def write_module(basedir: str, generated_modules: Iterable[str]) -> None:
    """Write an `__init__.py` that imports the names of these modules, unless the file is up to date."""
    text = "".join(f"from .{name} import *\n" for name in generated_modules)
    file = Path(basedir, "__init__.py")
    if not file.is_file() or file.read_text("utf-8") != text:
        file.write_text(text, encoding="utf-8")
