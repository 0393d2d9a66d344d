"""Packages with message definitions that a test writes."""

from pathlib import Path

from pipros.msg.language.definition_files import DefinitionFiles
from pipros.msg.language.definitions import Definitions


class Packages:
    """The packages in a folder, and their definitions."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.definitions = Definitions(DefinitionFiles(self.find))

    def write(self, path: str, text: str | bytes) -> Path:
        file = self.folder / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(text.encode() if isinstance(text, str) else text)
        return file

    def find(self, name: str) -> Path | None:
        return self.folder / name if (self.folder / name).is_dir() else None
