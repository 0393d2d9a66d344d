"""Colours for displaying label images."""

from __future__ import annotations

from typing import Any

from pipros.libraries.vision.extras import numpy as np

# Red, green and blue for the labels 0, 1, 2, …: the CSS colours in alphabetical order.
_COLORS = bytes.fromhex(
    "eff8fff9ebd600ffff7effd3effffff5f5dcffe3c4000000ffebcd0000ff892be1a42a2adeb8865f9e9f7eff00d2691e"
    "ff7e506394ecfff8dcdc133b00ffff00008a008a8ab8850aa9a9a9006300a9a9a9bcb76b8a008a546b2eff8b009931cc"
    "8a0000e995798fbb8f473c8a2e4f4f2e4f4f00ced19300d2ff139200beff6969696969691e90ffb12121fff9ef218a21"
    "ff00ffdcdcdcf8f8ffffd600daa41f808080008000acff2e808080efffefff69b4cd5c5c4a0082ffffefefe68be6e6f9"
    "ffeff57bfb00fff9cdacd7e6ef8080dffffff9f9d2d2d2d290ed90d2d2d2ffb6c1ff9f791fb1aa86cef9778799778799"
    "afc4deffffdf00ff0031cd31f9efe6ff00ff80000066cdaa0000cdb954d2926fdb3bb3707a68ed00f99a47d1ccc61585"
    "18186ff5fff9ffe3e0ffe3b5ffdeac000080fcf5e68080006b8e22ffa400ff4500da6fd5ede8aa97fa97aeededffeed4"
    "ffdab8cd853effc0cadd9fddafdfe6800080ff0000bb8f8f4169e08a4512f98071f9a35f2d8a56fff5ed9f522cc0c0c0"
    "86ceeb6a5acd6f80906f8090fff9f900ff7e4682b4d2b48b008080d7bed7ff624640dfd0ed82edf5deb3fffffff5f5f5"
    "ffff009acd31"
)


def color_of_label(labels: Any) -> Any:
    """Convert an integer image of shape (height, width) to colours.

    The result has the shape (height, width, 3), with the channels blue, green and red.

    Colours repeat after 146 labels. Negative labels are black, except multiples of 146.
    """
    table = np.frombuffer(_COLORS, np.uint8).reshape(-1, 3)[:, ::-1]
    colors = table[labels % len(table)]
    colors[(labels < 0) & (labels % len(table) != 0)] = 0
    return colors
