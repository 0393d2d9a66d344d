"""`rosrun image_view image_view image:=TOPIC`: shows a topic's images on the page."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from pipros.basics.names import parse_arguments
from pipros_page.commands.rqt import rqt_image_view
from pipros_tools.cli.entry_point import command

NOT_REMAPPED = "image_view: topic 'image' has not been remapped; type image_view image:=TOPIC"


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Show a topic's images on the page until Ctrl-C. Return the exit code.

    The topic is the name to which `image` is remapped. An argument such as `compressed`, or
    `_image_transport:=compressed`, selects the topic of this transport.
    """
    arguments = parse_arguments(list(sys.argv[1:] if argv is None else argv))
    words = list(arguments.rest)
    transport = words.pop(0) if words and not words[0].startswith("-") else "raw"
    transport = arguments.params.get("image_transport", transport)
    topic = arguments.remappings.get("image", "")
    if not topic:
        print(NOT_REMAPPED, file=sys.stderr)
    topic = topic or "image"
    return rqt_image_view([*words, topic if transport == "raw" else f"{topic}/{transport}"])
