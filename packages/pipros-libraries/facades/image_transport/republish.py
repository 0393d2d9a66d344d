"""`rosrun image_transport republish`: republish the images of a topic with another transport."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

from sensor_msgs.msg import CompressedImage, Image

import rospy
from image_transport.transports import PUBLISHED, SUBSCRIBED, topic_of
from pipros.basics.errors import PiprosError
from pipros.basics.interrupts import exits_after_ctrl_c
from pipros_libraries.topic_tools.raw import class_like

USAGE = "Usage: {} in_transport in:=<in_base_topic> [out_transport] out:=<out_base_topic>"

# Message class for images that are passed on unchanged, without decoding.
_RawImage: Any = class_like(
    {"type": Image._type, "md5sum": Image._md5sum, "message_definition": Image._full_text}
)
_Publish = Callable[[Any], None]


@exits_after_ctrl_c()
def main() -> int:
    """Run until the node is shut down. Return the exit code."""
    program, *arguments = rospy.myargv()
    if not arguments:
        print(USAGE.format(program))
        return 0
    source, targets = arguments[0], arguments[1:2] or PUBLISHED
    for transport, known in ((source, SUBSCRIBED), *((target, PUBLISHED) for target in targets)):
        if transport not in known:
            print(
                f"Unable to load plugin for transport '{transport}': it must be one of {', '.join(known)}",
                file=sys.stderr,
            )
            return 1
    rospy.init_node("image_republisher", anonymous=True)
    try:
        _connect(source, targets)
    except (ImportError, PiprosError) as error:
        rospy.logerr(str(error))
        return 1
    rospy.spin()
    return 0


def _connect(source: str, targets: list[str] | tuple[str, ...]) -> None:
    output, topic = rospy.resolve_name("out"), topic_of(rospy.resolve_name("in"), source)
    is_unchanged = [source, *targets] == ["raw", "raw"]
    outputs = [_raw_output(output) if is_unchanged else _output(output, target) for target in targets]

    def publish(image: Any) -> None:
        for each in outputs:
            each(image)

    if source == "raw":
        rospy.Subscriber(topic, _RawImage if is_unchanged else Image, publish, queue_size=1)
        return
    decompress = _decompressor()

    def on_compressed(message: CompressedImage) -> None:
        image = decompress(message)
        if image is not None:
            publish(image)

    rospy.Subscriber(topic, CompressedImage, on_compressed, queue_size=1)


def _raw_output(topic: str) -> _Publish:
    publisher = rospy.Publisher(topic, _RawImage, queue_size=1)
    return publisher.publish


def _output(topic: str, transport: str) -> _Publish:
    """Return a function that publishes an Image. Images are compressed only while there are subscribers."""
    if transport == "raw":
        publisher = rospy.Publisher(topic, Image, queue_size=1)
        return publisher.publish
    from image_transport.compression import compressor

    compress = compressor(topic_of(topic, transport))
    compressed = rospy.Publisher(topic_of(topic, transport), CompressedImage, queue_size=1)

    def publish(image: Image) -> None:
        message = compress(image) if compressed.get_num_connections() else None
        if message is not None:
            compressed.publish(message)

    return publish


def _decompressor() -> Callable[[CompressedImage], Image | None]:
    from image_transport.compression import decompressor

    return decompressor()
