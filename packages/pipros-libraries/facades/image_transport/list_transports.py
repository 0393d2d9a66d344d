"""`rosrun image_transport list_transports`: list the supported transports."""

from __future__ import annotations

from image_transport.transports import PUBLISHED, SUBSCRIBED

_ABOUT = {
    "raw": "Uncompressed image on the base topic (sensor_msgs/Image).",
    "compressed": "JPEG or PNG image, with OpenCV or Pillow (sensor_msgs/CompressedImage).",
    "compressedDepth": "Depth image as PNG, with OpenCV or Pillow (sensor_msgs/CompressedImage).",
}


def main() -> int:
    """Print the transports. Return the exit code."""
    names = [f"image_transport/{transport}" for transport in SUBSCRIBED]
    print("Declared transports:", *names, "", "Details:", "----------", sep="\n")
    for transport, name in zip(SUBSCRIBED, names, strict=True):
        print(f'"{name}"\n - Provided by package: image_transport')
        for end, known in (("Publisher", PUBLISHED), ("Subscriber", SUBSCRIBED)):
            if transport in known:
                print(f" - {end}: \n      {_ABOUT[transport]}\n    ")
    return 0
