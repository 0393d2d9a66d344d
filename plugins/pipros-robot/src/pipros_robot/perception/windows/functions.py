"""Replacements for OpenCV's window functions, with the names, arguments and results of `cv2`.

As in OpenCV, callbacks are called by `waitKey`, in the thread that calls it.
"""

from __future__ import annotations

import contextlib
import inspect
import time
from collections.abc import Callable
from typing import Any, Final

from pipros.basics.extras import required
from pipros.basics.interruptible_wait import SLICE_S, get_within_slice
from pipros.node import Node
from pipros_robot.perception.windows.window_page import Trackbar, Window, Windows
from pipros_server.node_page import served_page

JPEG_QUALITY: Final = 95
_SIGNED_MIDDLE: Final = 128
_VISIBLE, _ABSENT, _UNKNOWN = 1.0, 0.0, -1.0


class WindowFunctions:
    """The functions for one process. The first window starts the page.

    Args:
        cv2: the module, which provides errors, codecs and constants.
        node: the node whose shutdown closes the page.
    """

    def __init__(self, cv2: Any, node: Node) -> None:
        self._cv2 = cv2
        self.node = node
        self._windows = Windows(node.name, self._encode)
        self._page: contextlib.ExitStack | None = None

    def by_name(self) -> dict[str, Callable[..., Any]]:
        """Return the functions that replace functions of `cv2`, by name."""
        methods = inspect.getmembers(self, inspect.ismethod)
        return {name: method for name, method in methods if name[0] != "_" and name != "by_name"}

    def namedWindow(self, winname: str, flags: int = 1) -> None:  # noqa: ARG002
        """Open a window, if it is not open."""
        self._open(winname)

    def imshow(self, winname: str, mat: Any) -> None:
        """Show an image, converted to 8 bits with the same scaling as in OpenCV."""
        image = self._in_8_bits(mat)
        window = self._open(winname)
        with self._windows.lock:
            window.image = image
            window.number += 1

    def waitKey(self, delay: int = 0) -> int:
        """Call pending mouse and trackbar callbacks. Return the low byte of the next key, or -1.

        Args:
            delay: the longest wait in ms. If <= 0, wait until a key is pressed, the node is shut down, or no
                window is open.
        """
        code = self.waitKeyEx(delay)
        return code if code == -1 else code & 0xFF

    def waitKeyEx(self, delay: int = 0) -> int:
        """Like `waitKey`, but return the whole key code."""
        end = time.monotonic() + delay / 1000 if delay > 0 else None
        while True:
            left_s = SLICE_S if end is None else max(end - time.monotonic(), 0.0)
            event = get_within_slice(self._windows.events, left_s)
            if isinstance(event, int):
                return event
            if event is not None:
                event()
            elif self.node.is_ending or self._is_over(end):
                return -1

    def _is_over(self, end: float | None) -> bool:
        return not self._windows.by_name if end is None else time.monotonic() >= end

    def pollKey(self) -> int:
        """Like `waitKey`, but wait at most 1 ms."""
        return self.waitKey(1)

    def destroyWindow(self, winname: str) -> None:
        """Close a window, if it is open."""
        with self._windows.lock:
            self._windows.by_name.pop(winname, None)

    def destroyAllWindows(self) -> None:
        """Close all windows."""
        with self._windows.lock:
            self._windows.by_name.clear()

    def startWindowThread(self) -> int:
        """Return 1. The page does not need a thread for windows."""
        return 1

    def createTrackbar(
        self,
        trackbarName: str,
        windowName: str,
        value: int,
        count: int,
        onChange: Callable[[int], object] | None = None,
    ) -> None:
        """Add a slider from 0 to `count` to a window."""
        with self._windows.lock:
            bar = Trackbar(min(max(int(value), 0), int(count)), int(count), onChange)
            self._window(windowName).trackbars[trackbarName] = bar

    def getTrackbarPos(self, trackbarname: str, winname: str) -> int:
        """Return the value of a slider."""
        with self._windows.lock:
            return self._trackbar(trackbarname, winname).value

    def setTrackbarPos(self, trackbarname: str, winname: str, pos: int) -> None:
        """Move a slider, and call its callback if its value changes."""
        with self._windows.lock:
            bar = self._trackbar(trackbarname, winname)
            value = min(max(int(pos), bar.lowest), bar.highest)
            is_news, bar.value = value != bar.value, value
        if is_news and bar.on_change is not None:
            bar.on_change(value)

    def setTrackbarMax(self, trackbarname: str, winname: str, maxval: int) -> None:
        """Set the highest value of a slider."""
        with self._windows.lock:
            self._trackbar(trackbarname, winname).highest = int(maxval)

    def setTrackbarMin(self, trackbarname: str, winname: str, minval: int) -> None:
        """Set the lowest value of a slider."""
        with self._windows.lock:
            self._trackbar(trackbarname, winname).lowest = int(minval)

    def setMouseCallback(self, windowName: str, onMouse: Callable[..., object], param: Any = None) -> None:
        """Call `onMouse(event, x, y, flags, param)` for mouse events on the window's image."""

        def call(event: int, x: int, y: int, flags: int) -> None:
            onMouse(event, x, y, flags, param)

        with self._windows.lock:
            self._window(windowName).on_mouse = call

    def getMouseWheelDelta(self, flags: int) -> int:
        """Return the rotation of the mouse wheel; positive is forwards."""
        return flags >> 16

    def setWindowTitle(self, winname: str, title: str) -> None:
        """Set the title of a window."""
        with self._windows.lock:
            self._window(winname).title = title

    def getWindowProperty(self, winname: str, prop_id: int) -> float:
        """Return 1 or 0 for `WND_PROP_VISIBLE`, otherwise -1: the browser arranges the windows."""
        if prop_id != self._cv2.WND_PROP_VISIBLE:
            return _UNKNOWN
        return _VISIBLE if winname in self._windows.by_name else _ABSENT

    def getWindowImageRect(self, winname: str) -> tuple[int, int, int, int]:
        """Return 0, 0, and the width and height of the window's image."""
        with self._windows.lock:
            image = self._window(winname).image
        height, width = (0, 0) if image is None else image.shape[:2]
        return 0, 0, width, height

    def setWindowProperty(self, winname: str, prop_id: int, prop_value: float) -> None:
        """Do nothing: the browser arranges the windows."""

    def moveWindow(self, winname: str, x: int, y: int) -> None:
        """Do nothing: the browser arranges the windows."""

    def resizeWindow(self, winname: str, *size: Any, **named_size: Any) -> None:
        """Do nothing: the browser arranges the windows."""

    def _open(self, name: str) -> Window:
        if not isinstance(name, str):
            raise TypeError(f"the name of a window must be a str, got {type(name).__name__}")
        with self._windows.lock:
            if self._page is None:
                self._page = contextlib.ExitStack()
                self._page.enter_context(
                    served_page(self._windows.served_views(), self.node.name, self.node.log)
                )
                self.node.on_shutdown(self._page.close)
            return self._windows.by_name.setdefault(name, Window(name))

    def _window(self, name: str) -> Window:
        window = self._windows.by_name.get(name)
        if window is None:
            raise self._cv2.error(f"there is no window [{name}]: call cv2.namedWindow or cv2.imshow first")
        return window

    def _trackbar(self, label: str, name: str) -> Trackbar:
        bar = self._window(name).trackbars.get(label)
        if bar is None:
            raise self._cv2.error(f"the window [{name}] has no trackbar [{label}]")
        return bar

    def _in_8_bits(self, mat: Any) -> Any:
        """Return a copy of an image as an array of 8-bit numbers, with one, three or four channels.

        Raises:
            cv2.error: the array is empty, or not an image.
        """
        np = required("numpy", "windows of OpenCV need numpy", "vision")
        image = np.asarray(mat)
        if not image.size:
            raise self._cv2.error(f"the image is empty: its shape is {image.shape}. Was its file found?")
        if image.ndim not in (2, 3) or (image.ndim == 3 and image.shape[2] not in (1, 3, 4)):
            raise self._cv2.error(f"an image must be 2-D, or 3-D with 1, 3 or 4 channels, got {image.shape}")
        kind = image.dtype.name
        if kind == "uint8":
            return image.copy()
        if kind.startswith("float"):
            scaled = np.nan_to_num(image * 255.0)
        elif kind in ("uint16", "int32"):
            scaled = image / 256
        elif kind in ("int8", "int16"):
            scaled = image / (256 if kind == "int16" else 1) + _SIGNED_MIDDLE
        else:
            raise self._cv2.error(f"an image cannot have elements of the type {kind}")
        return np.clip(np.rint(scaled), 0, 255).astype("uint8")

    def _encode(self, image: Any) -> bytes:
        is_encoded, data = self._cv2.imencode(".jpg", image, [self._cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
        if not is_encoded:
            raise self._cv2.error(f"cannot show an image with the shape {image.shape}")
        return bytes(data)
