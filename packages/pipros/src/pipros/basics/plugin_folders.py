"""Find the installed plugins by their name: top-level packages `pipros_NAME` that contain a `plugin.py`.

Every failed import in the environment may need this, so it imports almost nothing. Listing the folders on
`sys.path` takes a millisecond; reading the metadata of all distributions would take fifty.
"""

from __future__ import annotations

import os
import sys

PREFIX = "pipros_"
DECLARATION = "plugin.py"


def plugin_folders() -> dict[str, str]:
    """Return the folders of the plugins, by package name, in the order of the names.

    The first package of a name on `sys.path` counts, as for an import. The working directory, which may be on
    it as an empty entry, does not: nobody has installed what is there. In a zip file, the folder is a path
    inside of it.
    """
    found: dict[str, str] = {}
    for entry in filter(os.path.isabs, dict.fromkeys(sys.path)):
        for name in _names(entry):
            found.setdefault(name, os.path.join(entry, name))
    return dict(sorted(found.items()))


def _names(entry: str) -> list[str]:
    try:
        names = os.listdir(entry)
    except NotADirectoryError:
        return _names_in_zip(entry)
    except OSError:
        return []
    return [
        name
        for name in names
        if name.startswith(PREFIX)
        and name.isidentifier()
        and os.path.isfile(os.path.join(entry, name, DECLARATION))
    ]


def _names_in_zip(entry: str) -> list[str]:
    from zipimport import ZipImportError, zipimporter

    try:
        archive = zipimporter(entry)
        files: dict[str, object] = archive._files  # type: ignore[attr-defined]
    except (ZipImportError, AttributeError):
        return []
    inside = [name.split(os.sep) for name in files if name.endswith(os.sep + DECLARATION)]
    return [parts[0] for parts in inside if len(parts) == 2 and parts[0].startswith(PREFIX)]
