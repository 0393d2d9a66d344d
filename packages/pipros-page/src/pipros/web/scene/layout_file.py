"""The configuration of the scene, and the `.rviz` file that it is read from and written to."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pipros.basics.limits import limit_text, process_limits
from pipros.basics.replaced_file import overwritten_file
from pipros.web.limits import PageLimits
from pipros.web.scene.rviz_file import RvizFileError, read_rviz, write_rviz


class SceneFile:
    """The configuration of the scene, which all browsers and the node's services share.

    Attributes:
        path: the file to save to; None if no file was opened.
        fixed_frame: overrides the file's fixed frame, if not empty.
        is_smooth: whether the scene is drawn with anti-aliasing.
        version: increases whenever a file is loaded.
    """

    def __init__(self, path: Path | None = None, fixed_frame: str = "", *, is_smooth: bool = True) -> None:
        self.path = path
        self.fixed_frame = fixed_frame
        self.is_smooth = is_smooth
        self.version = 0
        self.config: dict[str, Any] = {}
        if path is not None:
            self.load(path)

    def load(self, path: Path) -> None:
        """Read a file. From now on, `save` writes to this file.

        Raises:
            RvizFileError: the file is not an rviz configuration.
            OSError: the file cannot be read.
        """
        limit = process_limits().of(PageLimits).page_view_bytes
        with path.open("rb") as file:
            content = file.read(limit + 1)
        if len(content) > limit:
            raise RvizFileError(f"{path} is too large; {limit_text('page_view_bytes', limit)}")
        self.config = read_rviz(content, str(path))
        self.path = path
        self.version += 1

    def save(self, config: Any) -> Path:
        """Write the file, atomically.

        Raises:
            RvizFileError: the configuration cannot be written as a file, or no file was opened.
            OSError: the file cannot be written.
        """
        text = write_rviz(config)
        if self.path is None:
            raise RvizFileError("no file was opened; start rviz with -d FILE")
        self.path.parent.mkdir(exist_ok=True)
        with overwritten_file(self.path) as file:
            file.write(text.encode())
        self.config = config
        return self.path
