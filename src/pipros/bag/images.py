"""Save `sensor_msgs` images as files.

Raw images are saved as PNG files, without an image library. Compressed images are saved unchanged.
"""

from __future__ import annotations

from typing import Any

from pipros.bag.errors import BagError
from pipros.msg.class_finder import installed_class
from pipros.pictures.errors import PictureError
from pipros.pictures.image_message import image_png


def image_file(message: Any) -> tuple[str, bytes]:
    """Return the suffix and the contents of the image file.

    Raises:
        BagError: PNG does not support the encoding, the image has fewer bytes than its size requires, or the
            message definition differs from the installed one.
    """
    installed = installed_class(message._type)
    if installed is None or installed._md5sum != message._md5sum:
        raise BagError(f"the bag's definition of [{message._type}] must equal an installed package's")
    if message._type == "sensor_msgs/CompressedImage":
        data = bytes(message.data)
        return (".png" if data.startswith(b"\x89PNG") else ".jpg"), data
    try:
        return ".png", image_png(message)
    except PictureError as error:
        raise BagError(str(error)) from None
