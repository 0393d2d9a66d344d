"""A real browser for tests of the page: Debian's Chromium, driven by Playwright."""

from __future__ import annotations

import shutil

PACKAGES = ("chromium", "fonts-dejavu-core")
INSTALL = f"apt-get install --no-install-recommends {' '.join(PACKAGES)}"


def find_chromium() -> str | None:
    """Return the path of Chromium, or None."""
    return shutil.which("chromium")


def missing() -> list[str]:
    """Return the missing packages. Playwright itself is in the extra `dev`."""
    return [] if find_chromium() else list(PACKAGES)


if __name__ == "__main__":
    print(" ".join(missing()))
