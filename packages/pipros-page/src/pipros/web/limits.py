"""The limits of the page."""

from typing import NamedTuple

_MIB = 1024 * 1024


class PageLimits(NamedTuple):
    """The limits of the page. Get them with `limits.of(PageLimits)`, where `limits` is a `Limits`.

    Each limit is a maximum size, number or time, unless noted otherwise.

    Attributes:
        page_message_bytes: a message that a page decodes.
        page_view_bytes: data that a page keeps for one of its tabs, such as log entries, diagnostics or
            parameters; also the messages of one topic that are kept after a jump in a bag.
        page_layout_bytes: a panel layout, stored by a browser or in a file.
        page_topics: topics that all browsers connected to a page watch together.
        page_bags: bags that all browsers connected to a page have opened together.
        page_rewind_s: the time span for which a page keeps messages for its browsers.
        page_rewind_bytes: the messages that are kept for this time span.
        page_rewinds: browsers that show kept messages at the same time; for each of them, up to
            `page_rewind_bytes` stay in memory.
        page_notes_bytes: the file of a bag's notes.
        page_record_spare_bytes: minimum free disk space; with less, a recording by the page ends.
        page_export_bytes: the messages that a browser exports from a bag.
        page_exports: concurrent exports by all browsers connected to a page; each needs a temporary file.
        scene_resource_bytes: a mesh or a texture that the Scene tab reads from a package.
    """

    page_message_bytes: int = 128 * _MIB
    page_view_bytes: int = 8 * _MIB
    page_layout_bytes: int = 65_536
    page_topics: int = 500
    page_bags: int = 20
    page_rewind_s: float = 60.0
    page_rewind_bytes: int = 128 * _MIB
    page_rewinds: int = 4
    page_notes_bytes: int = 262_144
    page_record_spare_bytes: int = 1024 * _MIB
    page_export_bytes: int = 512 * _MIB
    page_exports: int = 2
    scene_resource_bytes: int = 100 * _MIB
