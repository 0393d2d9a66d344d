"""Files of tokens."""

from __future__ import annotations

from pathlib import Path

import pytest

from pipros_server.token_file import BadTokenFile, read_tokens


def written(folder: Path, text: str, mode: int = 0o600) -> str:
    file = folder / "tokens"
    file.write_text(text)
    file.chmod(mode)
    return str(file)


def test_each_line_has_a_token(tmp_path: Path) -> None:
    path = written(tmp_path, "# mine\nabcdefghijklmnop # phone\n\n0123456789-._~ABC\n")
    assert read_tokens(path) == ["abcdefghijklmnop", "0123456789-._~ABC"]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "contains no token"),
        ("# abcdefghijklmnop", "contains no token"),
        ("short", "at least 16 characters"),
        ("abcdefghijklmnop/", "letters, digits"),
        ("abcdefghijk lmnop", "letters, digits"),
    ],
)
def test_weak_tokens_are_refused(text: str, reason: str, tmp_path: Path) -> None:
    with pytest.raises(BadTokenFile, match=reason):
        read_tokens(written(tmp_path, text))


@pytest.mark.needs("file owners")
@pytest.mark.parametrize("mode", [0o640, 0o604, 0o620])
def test_files_that_others_can_use_are_refused(mode: int, tmp_path: Path) -> None:
    with pytest.raises(BadTokenFile, match="chmod 600"):
        read_tokens(written(tmp_path, "abcdefghijklmnop", mode))


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(BadTokenFile, match=r"cannot read .*none: No such file"):
        read_tokens(str(tmp_path / "none"))
