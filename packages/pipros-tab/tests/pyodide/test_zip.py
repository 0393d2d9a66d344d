"""Archives that a tab opens: what cannot be read is left out alone, and bombs are refused."""

from __future__ import annotations

import io
import json
import subprocess
import zipfile

from tests.support.environments import REPOSITORY

MODULE = REPOSITORY / "packages/pipros-tab/src/pipros/tab/page/zip.mjs"
PROGRAM = f"""
import {{ readFileSync }} from "node:fs";
import {{ filesOf }} from "{MODULE}";
const read = await filesOf(readFileSync(0), 1_000_000).catch((error) => error.message);
const texts = [...(read.files ?? [])].map(([name, [, data]]) => [name, String(data)]);
console.log(JSON.stringify(read.files ? [Object.fromEntries(texts), read.leftOut] : read));
"""


METHODS = {"odd": zipfile.ZIP_LZMA, "stored": zipfile.ZIP_STORED}
"""How files with these names are compressed."""


def opened(files: dict[str, bytes]) -> object:
    """Return the files and what is left out, or the error. The content `whole` is damaged if it is stored."""
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as file:
        for name, content in files.items():
            file.writestr(name, content, METHODS.get(name))
    content = archive.getvalue().replace(b"whole", b"WHOLE")
    command = ["node", "--input-type=module", "--eval", PROGRAM]
    done = subprocess.run(command, input=content, capture_output=True, check=True, timeout=60)
    return json.loads(done.stdout)


def test_an_entry_that_cannot_be_read_is_left_out_alone() -> None:
    files = {"a/first": b"1", "odd": b"2", "../out": b"3", "/root": b"4", "b\\c": b"5", "last": b"6"}
    assert opened(files) == [
        {"a/first": "49", "last": "54"},
        [
            "odd: it is compressed by the unknown method 14",
            "../out: its name is refused",
            "/root: its name is refused",
            "b\\c: its name is refused",
        ],
    ]


def test_a_damaged_entry_is_left_out() -> None:
    assert opened({"stored": b"whole", "last": b"6"}) == [{"last": "54"}, ["stored: it is damaged"]]


def test_an_archive_that_expands_too_much_is_refused() -> None:
    files = {f"zeros{number}": bytes(400_000) for number in range(3)}
    assert opened(files) == "the files of this archive are too large for a tab"
