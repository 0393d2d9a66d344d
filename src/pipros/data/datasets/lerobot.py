"""Write a data set through the library LeRobot, which users install in an environment with torch."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pipros.data.datasets.cameras import Picture, steady
from pipros.data.extras import user_library
from pipros.safe.settings import BadSettings

if TYPE_CHECKING:
    from pipros.data.bags import Bags
    from pipros.data.datasets.config import DatasetConfig
    from pipros.data.datasets.formats import Writer
    from pipros.data.datasets.rows import EpisodeRows

_GROUPS = {"observations": "observation.state", "actions": "action"}


@contextmanager
def lerobot_writer(folder: Path, config: DatasetConfig) -> Iterator[Writer]:
    """Yield a function that adds episodes to a new LeRobot data set, which is complete after the block.

    Raises `BadSettings` if the rate is not a whole number, gaps are kept, or the data set exists, and
    `MissingExtra` if the library is not installed.
    """
    made: list[Any] = []
    sizes: dict[str, tuple[int, int]] = {}
    if config.rate % 1 or config.gaps == "keep":
        raise BadSettings("the format lerobot needs a whole number as rate, and gaps: skip or hold")
    if folder.exists():
        raise BadSettings(f"{folder} is unfinished, and LeRobot cannot continue it. Choose a new folder")
    kind = user_library("lerobot.datasets.lerobot_dataset", "the format lerobot").LeRobotDataset

    def write(_: Path, rows: EpisodeRows, bags: Bags, __: int) -> int:
        names, columns = {}, {}
        broken: list[Picture] = []
        for group, key in _GROUPS.items():
            if found := [each for each in rows.signals if each.source.name.startswith(f"{group}.")]:
                columns[key] = np.concatenate([each.values for each in found], axis=1).astype(np.float32)
                pairs = [(each.source.short_name, name) for each in found for name in each.names]
                names[key] = [".".join(pair) for pair in pairs]
        cameras = {}
        for camera in rows.cameras:
            key = camera.source.name.replace("cameras.", "observation.images.")
            cameras[key] = steady(rows.pictures(bags, camera), broken)
        for row in range(len(rows.times)):
            frame: dict[str, Any] = {key: values[row] for key, values in columns.items()}
            for key, frames in cameras.items():
                picture = next(frames)
                size = sizes.setdefault(key, (picture.width, picture.height))
                frame[key] = picture.reformat(*size, "rgb24").to_ndarray()
            if not made:
                axes = names | {key: ["height", "width", "channels"] for key in cameras}
                kinds = {key: "video" if key in cameras else "float32" for key in frame}
                features = {
                    key: {"dtype": kinds[key], "shape": value.shape, "names": axes[key]}
                    for key, value in frame.items()
                }
                made.append(kind.create("local/data", int(config.rate), features, folder))
            made[0].add_frame({**frame, "task": rows.episode.task})
        made[0].save_episode()
        return len(broken)

    try:
        yield write
    finally:
        if made:
            made[0].finalize()
