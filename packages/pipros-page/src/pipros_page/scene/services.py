"""Services with which other nodes load and save rviz's configuration file."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any, Final

from pipros.basics.errors import PiprosError
from pipros.msg import load_service_class
from pipros.node import Node
from pipros_page.scene.layout_file import SceneFile

logger = logging.getLogger("pipros_page")

LOADING: Final = ("~load_config", "~load_config_discarding_changes")
SAVING: Final = "~save_config"


def serve_scene_file(node: Node, file: SceneFile, *, may_save: bool) -> None:
    """Offer `~load_config`, `~load_config_discarding_changes` and `~save_config`.

    The services accept only the file given with `-d` and `.rviz` files below `~/.rviz`, and save only if
    `may_save` is true. Any other request is logged, and the response is False.
    """
    kind = load_service_class("rviz/SendFilePath")
    first = file.path

    def load(request: Any) -> Any:
        return kind._response_class(_attempt("load", request.path.data, file, first, has_right=True))

    def save(request: Any) -> Any:
        return kind._response_class(_attempt("save", request.path.data, file, first, has_right=may_save))

    for name in LOADING:
        node.serve(name, kind, load)
    node.serve(SAVING, kind, save)


def _attempt(what: str, text: str, file: SceneFile, first: Path | None, *, has_right: bool) -> bool:
    try:
        if not has_right:
            raise PiprosError("start rviz with --control")
        path = permitted_path(text, first)
        if what == "load":
            file.load(path)
        else:
            file.path = path
            file.save(file.config)
    except (PiprosError, OSError, RuntimeError, ValueError) as error:  # no file can have this name
        logger.error("cannot %s %s: %s", what, text[:200], error)
        return False
    return True


def permitted_path(text: str, first: Path | None) -> Path:
    """Return the path of a file that services may read and write.

    Raises:
        PiprosError: the path is neither `first` nor a `.rviz` file below `~/.rviz`.
    """
    path = Path(text).resolve()
    if first is not None and path == first.resolve():
        return path
    folder = (Path.home() / ".rviz").resolve()
    if path.suffix != ".rviz" or not path.is_relative_to(folder):
        raise PiprosError(f"the file must be the one given with -d, or a .rviz file below {folder}")
    return path
