#!/usr/bin/env python3
"""Writes the Python packages of the shipped messages: a folder in `facades` for each package of definitions.

Each has type stubs made from the definitions. A package without other modules has an `__init__.py`, too, that
installs the import hook, so that `import std_msgs.msg` works where Python reads no `.pth` file. Run it
after a definition has changed; a test of the tree compares the result.
"""

import sys
from collections.abc import Iterator
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[4]
INIT = '''"""{what} of {package}, which pipros compiles when they are used."""

from pipros.startup import give_way as _give_way

_give_way(__name__)
'''


def message_packages(repository: Path = REPOSITORY) -> Iterator[tuple[Path, str]]:
    """Yield the path and the text of each file."""
    from pipros.msg.language.definition_files import DefinitionFiles
    from pipros.msg.language.definitions import Definitions
    from pipros.msg.stubs import package_stubs

    folders = {
        found.parent.name: found.parent for found in repository.glob("p*s/*/src/*/share/*/package.xml")
    }
    definitions = Definitions(DefinitionFiles(folders.get))
    for name, folder in sorted(folders.items()):
        # The packages with modules of the page and of bridges are beside these, all others beside `share`.
        facade = next(repository.glob(f"packages/*/facades/{name}"), folder.parents[3] / "facades" / name)
        stubs = package_stubs(name, definitions)
        is_facade = (facade / "__init__.py").is_file() and not (facade / "__init__.pyi").is_file()
        if not stubs:
            continue
        if is_facade:
            del stubs["__init__.pyi"]  # type checkers read its `__init__.py`
        else:
            kinds = {"msg": "messages", "srv": "services"}
            what = " and ".join(kind for part, kind in kinds.items() if f"{part}/__init__.pyi" in stubs)
            stubs["__init__.py"] = INIT.format(what=f"The {what}", package=name)
        for path, text in {**stubs, "py.typed": ""}.items():
            yield facade / path, text


def main() -> int:
    sys.path[:0] = [str(folder) for folder in (REPOSITORY / "packages").glob("*/src")]
    for file, text in message_packages():
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
