"""Edit text in the user's editor."""

from __future__ import annotations

import os
import subprocess
import tempfile

from pipros.basics.windows import ON_WINDOWS
from pipros.basics.words import split_words


def edited(text: str) -> str:
    """Open `text` in `$VISUAL`, `$EDITOR`, or vi (on Windows, notepad), and return the edited text.

    Blocks until the editor exits.

    Raises:
        ValueError: the editor cannot be started, or exits with an error.
    """
    usual = "notepad" if ON_WINDOWS else "vi"
    editor = split_words(os.environ.get("VISUAL") or os.environ.get("EDITOR") or usual)
    descriptor, path = tempfile.mkstemp(suffix=".yaml", text=True)
    try:
        with open(descriptor, "w", encoding="utf-8") as file:
            file.write(text + "\n")
        try:
            subprocess.run([*editor, path], check=True)  # noqa: S603
        except (OSError, subprocess.CalledProcessError) as error:
            raise ValueError(f"editor failed: {error}. Set VISUAL or EDITOR to another editor") from None
        with open(path, encoding="utf-8") as file:
            return file.read()
    finally:
        os.unlink(path)
