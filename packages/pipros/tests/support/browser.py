"""A real browser for tests of the page: Debian's Chromium, driven by Playwright.

`chromium --headless` also draws its own user interface. The headless shell has the same engine and no such
interface, and takes half of the processor time for all tests in a browser.
"""

import shutil

PROGRAMS = ("chromium-headless-shell", "chromium")
PACKAGES = (PROGRAMS[0], "fonts-dejavu-core")
INSTALL = f"apt-get install --no-install-recommends {' '.join(PACKAGES)}"


def find_chromium() -> str | None:
    """Return the path of Chromium, preferably of its headless shell, or None."""
    return next(filter(None, map(shutil.which, PROGRAMS)), None)


def missing() -> list[str]:
    """Return the missing packages. Playwright itself is in the extra `dev`."""
    return [] if find_chromium() else list(PACKAGES)


if __name__ == "__main__":  # for continuous integration, where `chromium` alone would be too slow
    print("" if shutil.which(PROGRAMS[0]) else " ".join(PACKAGES))
