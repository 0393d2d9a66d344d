"""A node that publishes the same four colours as an image in each encoding: `/image/<encoding>`."""

import base64
import struct
import zlib

from sensor_msgs.msg import CompressedImage, Image

import rospy

rospy.init_node("images")
# Red, green; blue, white: 4 x 4 pixels in blocks of two by two, so that Bayer patterns also work.
RGB = [[(255, 0, 0)] * 2 + [(0, 255, 0)] * 2] * 2 + [[(0, 0, 255)] * 2 + [(255, 255, 255)] * 2] * 2
GREY = [[0, 0, 85, 85]] * 2 + [[170, 170, 255, 255]] * 2


def pixels(code, values):
    return b"".join(struct.pack(code, *value) for row in values for value in row)


def bayer(pattern):
    places = [["rgb".index(pattern[2 * y + x]) for x in (0, 1)] for y in (0, 1)]
    return bytes(RGB[y][x][places[y % 2][x % 2]] for y in range(4) for x in range(4))


def luma(red, green, blue):
    return (
        round(0.299 * red + 0.587 * green + 0.114 * blue),
        min(255, round(128 - 0.169 * red - 0.331 * green + 0.5 * blue)),
        min(255, round(128 + 0.5 * red - 0.419 * green - 0.081 * blue)),
    )


def yuv(order):
    data = bytearray()
    for row in RGB:
        for left in (0, 2):
            (y0, u, v), (y1, _, _) = luma(*row[left]), luma(*row[left + 1])
            data += bytes({"y": y0, "Y": y1, "u": u, "v": v}[letter] for letter in order)
    return bytes(data)


PNG = (
    "iVBORw0KGgoAAAANSUhEUgAAAAQAAAAECAIAAAAmkwkpAAAAHklEQVR4nGXJsQ0AAAgDIOr/P9fVRFZSkMI4QtE/C5t8BQPTgUebAAAAAElF"
    "TkSuQmCC"
)
IMAGES = {
    "rgb8": (12, pixels("3B", RGB)),
    "bgr8": (12, pixels("3B", [[value[::-1] for value in row] for row in RGB])),
    "rgba8": (16, pixels("4B", [[(*value, 9) for value in row] for row in RGB])),
    "bgra8": (16, pixels("4B", [[(*value[::-1], 9) for value in row] for row in RGB])),
    "rgb16": (24, pixels("<3H", [[[part * 257 for part in value] for value in row] for row in RGB])),
    "bgr16": (24, pixels("<3H", [[[part * 257 for part in value[::-1]] for value in row] for row in RGB])),
    "mono8": (4, bytes(value for row in GREY for value in row)),
    "mono16": (8, pixels("<H", [[(value * 10 + 7,) for value in row] for row in GREY])),
    **{f"{depth}C1": (4 * size, pixels(code, [[(value // 2 - 100,) for value in row] for row in GREY]))
       for depth, size, code in (("8S", 1, "<b"), ("16S", 2, "<h"), ("32S", 4, "<i"), ("64F", 8, "<d"))},
    "32FC1": (16, pixels("<f", [[(value / 100 - 1,) for value in row] for row in GREY])),
    "bayer_rggb8": (4, bayer("rggb")), "bayer_bggr8": (4, bayer("bggr")), "bayer_gbrg8": (4, bayer("gbrg")),
    "bayer_grbg8": (4, bayer("grbg")), "yuv422": (8, yuv("uyvY")), "yuv422_yuy2": (8, yuv("yuYv")),
}  # fmt: skip
messages = {
    rospy.Publisher(f"/image/{name.lower()}", Image, queue_size=1): Image(
        width=4, height=4, encoding=name, step=step, data=data
    )
    for name, (step, data) in IMAGES.items()
}
compressed = CompressedImage(format="rgb8; png compressed bgr8", data=base64.b64decode(PNG))
messages[rospy.Publisher("/image/compressed", CompressedImage, queue_size=1)] = compressed


def depth_png():
    """Return the greys as a PNG of 16 bits: a row without a filter, and one of each filter but Paeth's."""
    rows = [struct.pack(">4H", *(value * 10 + 7 for value in row)) for row in GREY]
    lines = [b"\0" + rows[0]]
    lines.append(
        b"\1" + bytes((byte - (rows[1][i - 2] if i > 1 else 0)) % 256 for i, byte in enumerate(rows[1]))
    )
    lines.append(b"\2" + bytes((byte - rows[1][i]) % 256 for i, byte in enumerate(rows[2])))
    lines.append(
        b"\3"
        + bytes(
            (byte - ((rows[3][i - 2] if i > 1 else 0) + rows[2][i]) // 2) % 256
            for i, byte in enumerate(rows[3])
        )
    )
    parts = [
        (b"IHDR", struct.pack(">IIBBBBB", 4, 4, 16, 0, 0, 0, 0)),
        (b"IDAT", zlib.compress(b"".join(lines))),
        (b"IEND", b""),
    ]
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
        for name, data in parts
    )


depth = CompressedImage(format="16UC1; compressedDepth", data=struct.pack("<iff", 0, 0, 0) + depth_png())
messages[rospy.Publisher("/image/16uc1_depth", CompressedImage, queue_size=1)] = depth
rate = rospy.Rate(10)
while not rospy.is_shutdown():
    for publisher, message in messages.items():
        publisher.publish(message)
    rate.sleep()
