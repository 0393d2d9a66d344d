"""The complete contents of `manifest.xml`, the predecessor of catkin's `package.xml`.

This module is for programs that show or edit such files. Tools such as `rospack` need less, and use
`manifest.py`. Source: http://wiki.ros.org/Manifest
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field

from pipros.basics.errors import PiprosError
from pipros.safe import xml
from pipros.safe.xml import Element, XmlError

KNOWN_TAGS = frozenset(
    {
        *("author", "license", "logo", "url", "brief", "description", "status", "notes", "depend", "rosdep"),
        *("export", "review", "versioncontrol", "platform", "version", "rosbuild2", "catkin"),
    }
)


class MalformedManifest(PiprosError):
    """A manifest is malformed."""


def _filled(name: str, value: str) -> str:
    if not value or not isinstance(value, str):
        raise ValueError(f"bad '{name}' attribute")
    return value


@dataclass
class Depend:
    """A dependency on a package."""

    package: str

    def __post_init__(self) -> None:
        _filled("package", self.package)

    def __str__(self) -> str:
        return self.package

    __repr__ = __str__

    def xml(self) -> str:
        return f'<depend package="{self.package}" />'


@dataclass
class ROSDep:
    """A dependency on a system package."""

    name: str

    def __post_init__(self) -> None:
        _filled("name", self.name)

    def xml(self) -> str:
        return f'<rosdep name="{self.name}" />'


class VersionControl:
    """The location of the sources."""

    def __init__(self, type_: str, url: str) -> None:
        self.type = type_
        self.url = url

    def xml(self) -> str:
        if self.url:
            return f'<versioncontrol type="{self.type}" url="{self.url}" />'
        return f'<versioncontrol type="{self.type}" />'


class Platform:
    """An operating system on which the package is known to work."""

    def __init__(self, os: str, version: str, notes: str | None = None) -> None:
        self.os = _filled("os", os)
        self.version = _filled("version", version)
        self.notes = notes

    def __str__(self) -> str:
        return f"{self.os} {self.version}"

    __repr__ = __str__

    def xml(self) -> str:
        if self.notes is not None:
            return f'<platform os="{self.os}" version="{self.version}" notes="{self.notes}"/>'
        return f'<platform os="{self.os}" version="{self.version}"/>'


class Export:
    """An export for the package named by `tag`. `attrs` and `str` are its attributes and its text."""

    def __init__(self, tag: str, attrs: Mapping[str, str], str: str) -> None:  # noqa: A002  # roslib's name
        self.tag = tag
        self.attrs = attrs
        self.str = str

    def get(self, attr: str) -> str | None:
        """Return the value of an attribute."""
        return self.attrs.get(attr)

    def xml(self) -> str:
        attributes = "".join(f' {name}="{value}" ' for name, value in self.attrs.items()).rstrip()
        if self.str:
            return f"<{self.tag}{attributes}>{self.str}</{self.tag}>"
        return f"<{self.tag}{attributes} />"


@dataclass
class DryManifest:
    """The contents of a `manifest.xml`.

    Attributes:
        unknown_tags: elements that the format does not define.
    """

    description: str | None = None
    brief: str = ""
    author: str = ""
    license: str = ""
    license_url: str = ""
    url: str | None = None
    logo: str | None = None
    status: str = ""
    notes: str = ""
    version: str | None = None
    depends: list[Depend] = field(default_factory=list)
    rosdeps: list[ROSDep] = field(default_factory=list)
    exports: list[Export] = field(default_factory=list)
    platforms: list[Platform] = field(default_factory=list)
    versioncontrol: VersionControl | None = None
    unknown_tags: list[str] = field(default_factory=list)

    def get_export(self, tag: str, attr: str) -> list[str | None]:
        """Return the values of an attribute in all exports with the given tag."""
        return [
            export.get(attr) for export in self.exports if export.tag == tag and export.get(attr) is not None
        ]

    def xml(self) -> str:
        """Return the contents in the format of a manifest file."""
        if not self.brief:
            described = f"  <description>{self.description}</description>"
        else:
            described = f'  <description brief="{self.brief}">{self.description}</description>'
        lines = ["<package>", described, f"  <author>{self.author}</author>"]
        if self.license_url:
            lines.append(f'  <license url="{self.license_url}">{self.license}</license>')
        else:
            lines.append(f"  <license>{self.license}</license>")
        lines.append(f'  <review status="{self.status}" notes="{self.notes}" />')
        lines += [
            f"  <{tag}>{text}</{tag}>" for tag, text in (("url", self.url), ("logo", self.logo)) if text
        ]
        parts: Iterable[Depend | ROSDep | Platform] = [
            *self.depends,
            *self.rosdeps,
            *self.platforms,
        ]
        lines += [f"  {part.xml()}" for part in parts]
        if self.exports:
            lines += ["  <export>", "\n".join(f"  {export.xml()}" for export in self.exports) + "  </export>"]
        if self.versioncontrol:
            lines.append(f"  {self.versioncontrol.xml()}")
        if self.version:
            lines.append(f"  <version>{self.version}</version>")
        return "\n".join([*lines, "</package>"])


def read_into(manifest: DryManifest, text: str, file: str) -> None:
    """Fill a manifest with the content of a file.

    Raises:
        MalformedManifest: the text is not a manifest, or a `<depend>` does not name a package.
        KeyError: another element lacks a required attribute.
        ValueError: a required attribute is empty.
    """
    try:
        root = xml.parse(text, file)
    except XmlError as error:
        raise MalformedManifest(f"invalid XML: {error}") from None
    if root.tag != "package":
        raise MalformedManifest("manifest must have a single 'package' element")
    manifest.description = _inner("description", root, text)
    described = root.first("description")
    manifest.brief = described.attributes.get("brief", "") if described else ""
    manifest.author = ", ".join(author.text.strip() for author in root.all("author"))
    manifest.license = ", ".join(element.text.strip() for element in root.all("license"))
    license_ = root.first("license")
    manifest.license_url = license_.attributes.get("url", "") if license_ else ""
    manifest.url, manifest.logo, manifest.version = (_text(root, tag) for tag in ("url", "logo", "version"))
    review = root.first("review")
    manifest.status = review.attributes.get("status", "") if review else "unreviewed"
    manifest.notes = review.attributes.get("notes", "") if review else ""
    manifest.depends = [Depend(name) for name in _depends(root)]
    manifest.rosdeps = [ROSDep(rosdep.attributes["name"]) for rosdep in root.all("rosdep")]
    manifest.platforms = [
        Platform(element.attributes["os"], element.attributes["version"], element.attributes.get("notes", ""))
        for element in root.all("platform")
    ]
    manifest.exports = [
        Export(element.tag, dict(element.attributes), element.text.strip())
        for export in root.all("export")
        for element in export.children
    ]
    control = root.first("versioncontrol")
    if control is not None:
        url = control.attributes.get("url", "")
        manifest.versioncontrol = VersionControl(control.attributes["type"], url)
    manifest.unknown_tags = [element.tag for element in root.children if element.tag not in KNOWN_TAGS]


def _depends(root: Element) -> Iterator[str]:
    for depend in root.all("depend"):
        if not depend.attributes.get("package"):
            raise MalformedManifest("Invalid manifest file: depends is missing 'package' attribute")
        yield depend.attributes["package"]


def _text(root: Element, tag: str) -> str | None:
    found = [element.text.strip() for element in root.all(tag)]
    return ", ".join(found) if found else None


def _inner(tag: str, root: Element, text: str) -> str | None:
    """Return the contents of an element as written, including child elements."""
    if root.first(tag) is None:
        return None
    found = re.search(rf"<{tag}\b[^>]*?(?:/>|>(.*?)</{tag}\s*>)", text, re.DOTALL)
    return (found[1] or "").strip() if found else ""
