"""A real browser for tests of the page: Debian's Chromium, driven by Playwright."""

from __future__ import annotations

import importlib.util
import shutil

PACKAGES = ("chromium", "fonts-dejavu-core")
INSTALL = f"apt-get install --no-install-recommends {' '.join(PACKAGES)} && .venv/bin/pip install playwright"


def find_chromium() -> str | None:
    """Return the path of Chromium, or None."""
    return shutil.which("chromium")


def missing() -> list[str]:
    """Return the missing packages."""
    has_playwright = importlib.util.find_spec("playwright") is not None
    return [*([] if find_chromium() else PACKAGES), *([] if has_playwright else ["playwright"])]


if __name__ == "__main__":
    print(" ".join(missing()))
