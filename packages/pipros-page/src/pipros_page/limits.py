"""The limits of the page."""

from typing import NamedTuple

_MIB = 1024 * 1024


class PageLimits(NamedTuple):
    """The limits of the page. Get them with `limits.of(PageLimits)`, where `limits` is a `Limits`.

    Each limit is a maximum size, number or time, unless noted otherwise.

    Attributes:
        page_message_bytes: a message that a page decodes.
        page_topics: topics that all browsers connected to a page watch together.
        page_rewind_bytes: the messages that are kept, so that browsers can rewind.
        page_record_spare_bytes: minimum free disk space; with less, a recording by the page ends.
        page_export_bytes: the messages that a browser exports from a bag.
        scene_resource_bytes: a mesh or a texture that the Scene tab reads from a package.
    """

    page_message_bytes: int = 128 * _MIB
    page_topics: int = 500
    page_rewind_bytes: int = 128 * _MIB
    page_record_spare_bytes: int = 1024 * _MIB
    page_export_bytes: int = 512 * _MIB
    scene_resource_bytes: int = 100 * _MIB
