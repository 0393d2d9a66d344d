"""The pages of the documents: those in `docs`, and those in the `docs` folder of their package or plugin.

All folders have the same shelves; the site shows them as one. Links between pages are those of files, so that
they also work where the tree is read. mkdocs calls this file's hooks.
"""

import os
import re
from pathlib import Path
from typing import Any

from tests.support.environments import REPOSITORY

FOLDERS = tuple(folder for folder in sorted(REPOSITORY.glob("p*/*/docs")) if folder.is_dir())
"""The folders of packages and plugins. A plugin that is removed takes its pages with it."""

_LINK = re.compile(
    r"(?:(?<=\]\()|(?<=href=\")|(?<=src=\"))([\w./-]+\.(?:md|ipynb|png|svg|webp|css|js))(?=[)#\"])"
)


def pages() -> dict[str, Path]:
    """Return the files of all pages, by their names on the site: `guides/bags.md`."""
    folders = (REPOSITORY / "docs", *FOLDERS)
    found = {
        file.relative_to(folder).as_posix(): file
        for folder in folders
        for file in (*folder.rglob("*.md"), *folder.rglob("*.ipynb"))
    }
    return dict(sorted(found.items()))


def page(name: str) -> Path:
    """Return the file of a page: `page("guides/bags.md")`."""
    return pages()[name]


def text_of(name: str) -> str:
    """Return the text of a page."""
    return page(name).read_text(encoding="utf-8")


APART = ("reference/evidence.md", "internals/differences.md", "internals/limits.md")
"""Pages to look things up in: one that is generated, and two appendices. `words` does not count them."""


def words() -> dict[str, int]:
    """Return the number of words of each shelf, without code, notebooks and the pages `APART`."""
    counts: dict[str, int] = {}
    for name, file in pages().items():
        if file.suffix == ".md" and name not in APART:
            text = re.sub(r"(?ms)^```.*?^```$", "", file.read_text(encoding="utf-8"))
            shelf = name.rpartition("/")[0] or name
            counts[shelf] = counts.get(shelf, 0) + len(text.split())
    return counts


def on_config(config: Any) -> Any:
    """Leave out the pages of plugins that were removed."""
    known = pages()
    for shelf in config.nav:
        for title, names in shelf.items() if isinstance(shelf, dict) else ():
            shelf[title] = [each for each in names if each in known]
    return config


def _on_files(files: Any, config: Any) -> Any:
    """Add the pages of packages and plugins."""
    from mkdocs.structure.files import File  # only mkdocs calls this

    for folder in FOLDERS:
        for file in sorted(folder.rglob("*")):
            if file.is_file():
                path = file.relative_to(folder).as_posix()
                files.append(File(path, str(folder), config.site_dir, config.use_directory_urls))
    return files


try:
    from mkdocs.plugins import event_priority
except ImportError:  # tests need no mkdocs
    pass
else:
    on_files = event_priority(100)(_on_files)  # before the plugin that converts notebooks


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    return as_on_site(markdown, Path(page.file.abs_src_path), page.file.src_uri)


def as_on_site(markdown: str, file: Path, name: str) -> str:
    """Turn links between files of the tree into links between pages of the site."""
    roots = (REPOSITORY / "docs", *FOLDERS)

    def as_link(match: re.Match[str]) -> str:
        target = Path(os.path.normpath(file.parent / match[1]))
        for root in roots:
            if target.is_relative_to(root):
                return os.path.relpath(target.relative_to(root), Path(name).parent)
        return match[1]

    return _LINK.sub(as_link, markdown)


if __name__ == "__main__":
    for shelf, count in {**words(), "all": sum(words().values())}.items():
        print(f"{count:7,} {shelf}")
