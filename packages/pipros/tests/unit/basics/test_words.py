"""Command lines as words."""

from __future__ import annotations

import pytest

from pipros.basics.words import quoted, split_words


@pytest.mark.parametrize(
    ("text", "posix", "windows"),
    [
        (r"a\ b c", ["a b", "c"], ["a\\", "b", "c"]),
        (
            r"C:\maps\x.yaml '--title=a b'",
            ["C:mapsx.yaml", "--title=a b"],
            [r"C:\maps\x.yaml", "--title=a b"],
        ),
        (
            r'"C:\my maps\new.yaml" # 2',
            [r"C:\my maps\new.yaml", "#", "2"],
            [r"C:\my maps\new.yaml", "#", "2"],
        ),
        ("--x=a'b'\"c\" ''", ["--x=abc", ""], ["--x=abc", ""]),
    ],
)
def test_backslashes_stay_in_paths_of_windows(
    text: str, posix: list[str], windows: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pipros.basics.words.ON_WINDOWS", False)
    assert split_words(text) == posix
    monkeypatch.setattr("pipros.basics.words.ON_WINDOWS", True)
    assert split_words(text) == windows
    with pytest.raises(ValueError, match="No closing quotation"):
        split_words("'open")


def test_words_are_quoted_for_the_shells_of_windows(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pipros.basics.words.ON_WINDOWS", True)
    assert quoted("C:\\Python311\\python.exe") == "C:\\Python311\\python.exe"
    assert quoted("pipros[course]") == '"pipros[course]"'
