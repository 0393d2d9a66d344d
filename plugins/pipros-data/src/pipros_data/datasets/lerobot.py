"""Write a data set with the LeRobot library, which users install in an environment with torch.

LeRobot cannot continue a data set whose process was killed. Therefore, each episode is written as a
separate data set in `parts`, and LeRobot joins these data sets at the end.
"""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pipros.basics.windows import replace_file
from pipros.safe.settings import BadSettings
from pipros_data.datasets.cameras import Picture, steady
from pipros_data.extras import user_library

if TYPE_CHECKING:
    from pipros_data.bags import Bags
    from pipros_data.datasets.config import DatasetConfig
    from pipros_data.datasets.episodes import Episode
    from pipros_data.datasets.rows import EpisodeRows

LEROBOT = "lerobot"
_GROUPS = {"observations": "observation.state", "actions": "action"}


def check_lerobot(config: DatasetConfig) -> None:
    """Check that LeRobot supports the description.

    Raises:
        BadSettings: the rate is not a whole number, or gaps are kept.
        MissingExtra: LeRobot is not installed.
    """
    if config.rate % 1 or config.gaps == "keep":
        raise BadSettings("the format lerobot needs a whole number as the rate, and gaps: skip or hold")
    _library("lerobot_dataset")


def write_lerobot(folder: Path, rows: EpisodeRows, bags: Bags, _: int) -> int:
    """Write an episode as a data set. Return the number of damaged pictures."""
    root = folder / "parts" / rows.episode.name
    shutil.rmtree(root, ignore_errors=True)  # a killed process may have left files
    names, columns = {}, {}
    broken: list[Picture] = []
    for group, key in _GROUPS.items():
        if found := [each for each in rows.signals if each.source.name.startswith(f"{group}.")]:
            columns[key] = np.concatenate([each.values for each in found], axis=1).astype(np.float32)
            names[key] = [f"{each.source.short_name}.{name}" for each in found for name in each.names]
    cameras = {
        f"observation.images.{each.source.short_name}": steady(rows.pictures(bags, each), broken)
        for each in rows.cameras
    }
    made: Any = None
    sizes: dict[str, tuple[int, int]] = {}
    for row in range(len(rows.times)):
        frame: dict[str, Any] = {key: values[row] for key, values in columns.items()}
        for key, frames in cameras.items():
            picture = next(frames)
            size = sizes.setdefault(key, (picture.width, picture.height))
            frame[key] = picture.reformat(*size, "rgb24").to_ndarray()
        if made is None:
            axes = names | {key: ["height", "width", "channels"] for key in cameras}
            kinds = {key: "video" if key in cameras else "float32" for key in frame}
            features = {
                key: {"dtype": kinds[key], "shape": value.shape, "names": axes[key]}
                for key, value in frame.items()
            }
            kind = _library("lerobot_dataset").LeRobotDataset
            made = kind.create("local/data", int(rows.rate), features, root)
        made.add_frame({**frame, "task": rows.episode.task})
    made.save_episode()
    made.finalize()
    return len(broken)


def join_lerobot(folder: Path, episodes: Sequence[Episode]) -> None:
    """Join the parts of a data set, unless they are joined already.

    Raises:
        BadSettings: LeRobot rejects the parts, for example because their pictures differ in size.
    """
    parts = folder / "parts"
    roots = [root for each in episodes if (root := parts / each.name).exists()]
    if not (folder / LEROBOT).exists() and roots:
        unfinished = parts / LEROBOT
        shutil.rmtree(unfinished, ignore_errors=True)
        join = _library("aggregate").aggregate_datasets
        try:
            join(["local/data"] * len(roots), "local/data", roots=roots, aggr_root=unfinished)
        except ValueError as error:
            raise BadSettings(f"LeRobot cannot join the episodes: {error}") from error
        replace_file(unfinished, folder / LEROBOT)
    shutil.rmtree(parts, ignore_errors=True)


def _library(module: str) -> Any:
    return user_library(f"lerobot.datasets.{module}", "the format lerobot")
