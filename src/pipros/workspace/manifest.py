"""Package manifests (`package.xml`), read quickly: what tools that look at many packages need of them.

Formats 1, 2 and 3; conditions on dependencies are those of Noetic. To check a manifest is the business of
the build, not of this reader.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from pipros.input_file import read_file
from pipros.packages.crawl import MANIFEST
from pipros.safe.xml import Element, XmlError, parse

# What each element of a manifest means, in the words of format 3; in the order in which rospack names them.
_MEANING: dict[str, tuple[str, ...]] = {
    "run_depend": ("build_export_depends", "exec_depends"),
    "exec_depend": ("exec_depends",),
    "depend": ("build_depends", "build_export_depends", "exec_depends"),
    "build_depend": ("build_depends",),
    "build_export_depend": ("build_export_depends",),
    "buildtool_depend": ("buildtool_depends",),
    "test_depend": ("test_depends",),
    "doc_depend": ("doc_depends",),
}

_CONDITION_VALUES = {"$ROS_VERSION": "1", "$ROS_PYTHON_VERSION": "3", "$ROS_DISTRO": "noetic"}
_COMPARISON = re.compile(r"""\s*(\S+?)\s*(==|!=)\s*['"]?([^'"\s]+)['"]?\s*""")


@dataclass(frozen=True, slots=True)
class Manifest:
    """One manifest.

    Attributes:
        dependencies: (kind, name), such as `("exec_depends", "rospy")`, one kind of element after another.
        exports: the elements below `<export>`.
    """

    name: str
    version: str
    description: str
    dependencies: tuple[tuple[str, str], ...]
    exports: tuple[Element, ...]

    def depends(self, *kinds: str) -> list[str]:
        """The names in the lists given, by default in all of them, each once."""
        return list(dict.fromkeys(name for kind, name in self.dependencies if not kinds or kind in kinds))


def read_manifest(package: Path) -> Manifest:
    """The manifest in a package's folder.

    Raises:
        XmlError: it is no XML; with file, line and column.
        OSError: it cannot be read.
    """
    file = package / MANIFEST
    root = parse(read_file(file), str(file))
    if root.tag != "package":
        raise XmlError(str(file), root.line, root.column, "the root element is not <package>")
    dependencies = []
    for tag, kinds in _MEANING.items():
        for child in root.children:
            if child.tag == tag and child.text.strip() and _holds(child.attributes.get("condition", "")):
                dependencies += [(kind, child.text.strip()) for kind in kinds]
    export = root.first("export")
    return Manifest(
        name=_text(root, "name") or package.name,
        version=_text(root, "version"),
        description=_text(root, "description"),
        dependencies=tuple(dependencies),
        exports=tuple(export.children) if export else (),
    )


def _text(root: Element, tag: str) -> str:
    element = root.first(tag)
    return "" if element is None else " ".join(element.text.split())


def _holds(condition: str) -> bool:
    """A condition of format 3; comparisons of versions joined by `and` are all that is in use."""
    for part in re.split(r"\band\b", condition):
        compared = _COMPARISON.fullmatch(part)
        if compared is None:
            continue
        left, operator, right = compared.groups()
        is_equal = _CONDITION_VALUES.get(left, left) == _CONDITION_VALUES.get(right, right)
        if is_equal is (operator == "!="):
            return False
    return True
