"""Read the parts of package manifests (`package.xml`) that tools such as `rospack` need.

Formats 1, 2 and 3 and the `manifest.xml` of dry packages are supported. Conditions on dependencies are
evaluated with Noetic's values. Manifests are not validated.

The build uses catkin_pkg, which validates manifests. For tools, catkin_pkg would be too slow: it takes 50 ms
to import and 0.4 ms per manifest, while this module takes 22 ms (mostly modules that the command imports
anyway) and 0.1 ms. In a workspace of 200 packages, catkin_pkg would add about 0.1 s to every `rospack` call,
including each Tab completion. Moreover, catkin_pkg rejects manifests that genuine rospack accepts, such as a
manifest without a maintainer. (Measured with the 84 manifests below /usr/share that Debian's ROS packages
install.)
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from pipros.basics.env import DISTRIBUTION
from pipros.basics.input_file import read_file
from pipros.packages.crawl import DRY_MANIFEST, MANIFEST
from pipros.safe.xml import Element, XmlError, parse

# The format 3 dependency lists to which each element contributes, in rospack's output order.
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

_CONDITION_VALUES = {f"${name}": value for name, value in DISTRIBUTION.items()}
_COMPARISON = re.compile(r"""\s*(\S+?)\s*(==|!=)\s*['"]?([^'"\s]+)['"]?\s*""")


@dataclass(frozen=True, slots=True)
class Manifest:
    """The parts of a manifest that tools need.

    Attributes:
        dependencies: pairs (kind, name), such as `("exec_depends", "rospy")`, in rospack's output order.
        exports: the elements below `<export>`.
        is_dry: whether it is a `manifest.xml`.
        rosdeps: the system packages in a `manifest.xml`; other manifests list them as dependencies.
    """

    name: str
    version: str
    description: str
    dependencies: tuple[tuple[str, str], ...]
    exports: tuple[Element, ...]
    is_dry: bool = False
    rosdeps: tuple[str, ...] = ()

    def depends(self, *kinds: str) -> list[str]:
        """Return the names in the given lists (by default all lists), without duplicates."""
        return list(dict.fromkeys(name for kind, name in self.dependencies if not kinds or kind in kinds))


def read_manifest(package: Path) -> Manifest:
    """Return the manifest in a package's folder.

    Raises:
        XmlError: the manifest is not well-formed, or its root element is not `<package>`; the message names
            the file, line and column.
        OSError: the manifest cannot be read.
    """
    file = package / MANIFEST
    is_dry = not file.is_file() and (package / DRY_MANIFEST).is_file()
    if is_dry:
        file = package / DRY_MANIFEST
    root = parse(read_file(file), str(file))
    if root.tag != "package":
        raise XmlError(str(file), root.line, root.column, "the root element must be <package>")
    dependencies = []
    for tag, kinds in _MEANING.items():
        for child in root.children:
            if child.tag == tag and child.text.strip() and _holds(child.attributes.get("condition", "")):
                dependencies += [(kind, child.text.strip()) for kind in kinds]
    if is_dry:
        dependencies = [
            (kind, name) for name in _attributes(root, "depend", "package") for kind in _MEANING["depend"]
        ]
    export = root.first("export")
    return Manifest(
        name=_text(root, "name") or package.name,
        version=_text(root, "version"),
        description=_text(root, "description"),
        dependencies=tuple(dependencies),
        exports=tuple(export.children) if export else (),
        is_dry=is_dry,
        rosdeps=tuple(_attributes(root, "rosdep", "name")) if is_dry else (),
    )


def _attributes(root: Element, tag: str, name: str) -> list[str]:
    """Return the non-empty values of an attribute in all child elements with the given tag."""
    values = (child.attributes.get(name, "") for child in root.children if child.tag == tag)
    return [value for value in values if value]


def _text(root: Element, tag: str) -> str:
    element = root.first(tag)
    return "" if element is None else " ".join(element.text.split())


def _holds(condition: str) -> bool:
    """Return whether a format 3 condition holds.

    Only comparisons with `==` or `!=`, joined by `and`, are evaluated; other expressions count as true.
    """
    for part in re.split(r"\band\b", condition):
        compared = _COMPARISON.fullmatch(part)
        if compared is None:
            continue
        left, operator, right = compared.groups()
        is_equal = _CONDITION_VALUES.get(left, left) == _CONDITION_VALUES.get(right, right)
        if is_equal is (operator == "!="):
            return False
    return True
