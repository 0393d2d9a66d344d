"""Write an episode as Parquet or HDF5."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pipros.basics.replaced_file import replaced_file
from pipros_data.datasets.cameras import write_video
from pipros_data.extras import library
from pipros_data.files import write_arrow

if TYPE_CHECKING:
    from pipros_data.bags import Bags
    from pipros_data.datasets.rows import CameraRows, EpisodeRows

_JPEGS = 200
"""Number of JPEG pictures in a row group."""

Writer = Callable[[Path, "EpisodeRows", "Bags", int], int]
"""Writes an episode below a folder, with a number of threads; returns the number of damaged pictures."""


def write_parquet(folder: Path, rows: EpisodeRows, bags: Bags, threads: int) -> int:
    """Write `data/EPISODE.parquet`, and the pictures as videos or as `pictures/CAMERA/EPISODE.parquet`."""
    pa = library("pyarrow", "Parquet")
    count = len(rows.times)
    columns: dict[str, Any] = {
        "episode_index": pa.array(np.full(count, rows.episode.number)),
        "frame_index": pa.array(np.arange(count)),
        "timestamp": pa.array(rows.seconds),
        "time": pa.array(rows.times.view("M8[ns]")),
        "task": pa.array([rows.episode.task] * count, pa.string()),
    }
    for signal in rows.signals:
        width = len(signal.names)
        flat = pa.array(signal.values.reshape(-1), from_pandas=True)  # NaN becomes null
        columns[signal.source.name] = pa.ListArray.from_arrays(
            pa.array(np.arange(0, (count + 1) * width, width, dtype=np.int32)), flat
        )
    for camera in rows.cameras:
        columns[f"{camera.source.name}.is_gap"] = pa.array(camera.gaps)
    table = pa.table(columns)
    fields = [
        table.schema.field(name).with_metadata({key: str(value) for key, value in described.items()})
        for name, described in {**{key: {} for key in columns}, **_descriptions(rows)}.items()
    ]
    write_arrow([table.cast(pa.schema(fields))], _file(folder, "data", rows, "parquet"), "parquet")
    broken = 0
    for camera in rows.cameras:
        if camera.source.store == "video":
            broken += _video(folder, rows, camera, bags, threads)
        else:
            path = _file(folder, f"pictures/{_short(camera)}", rows, "parquet")
            write_arrow(_jpeg_tables(pa, camera, rows.pictures(bags, camera)), path, "parquet")
    return broken


def write_hdf5(folder: Path, rows: EpisodeRows, bags: Bags, threads: int) -> int:
    """Write `data/EPISODE.hdf5`, with the groups `observations`, `actions` and `cameras`, and write videos.

    JPEG pictures are stored in the HDF5 file.
    """
    h5py = library("h5py", "HDF5")
    broken = 0
    with replaced_file(_file(folder, "data", rows, "hdf5")) as target, h5py.File(target, "w") as file:
        file.attrs["task"], file.attrs["rate"] = rows.episode.task, rows.rate
        file.attrs["episode"], file.attrs["bag"] = rows.episode.number, rows.episode.bag
        file["timestamp"], file["time"] = rows.seconds, rows.times
        descriptions = _descriptions(rows)
        for signal in rows.signals:
            name = signal.source.name.replace(".", "/")
            file.create_dataset(name, data=signal.values).attrs.update(descriptions[signal.source.name])
        for camera in rows.cameras:
            group = file.create_group(camera.source.name.replace(".", "/"))
            group["is_gap"] = camera.gaps
            if camera.source.store == "video":
                broken += _video(folder, rows, camera, bags, threads)
                group.attrs["video"] = f"videos/{_short(camera)}/{rows.episode.name}.mp4"
                continue
            cells = group.create_dataset("jpeg", (len(rows.times),), h5py.vlen_dtype(np.uint8))
            for row, picture in enumerate(rows.pictures(bags, camera)):
                if not camera.gaps[row]:
                    cells[row] = np.frombuffer(picture, np.uint8)
    return broken


WRITERS: dict[str, tuple[Writer, str]] = {
    "hdf5": (write_hdf5, "h5py"),
    "parquet": (write_parquet, "pyarrow"),
}
"""The function for each format, and the library that it needs."""


def _file(folder: Path, kind: str, rows: EpisodeRows, suffix: str) -> Path:
    path = folder / kind / f"{rows.episode.name}.{suffix}"
    path.parent.mkdir(parents=True, exist_ok=True)
    return path


def _short(camera: CameraRows) -> str:
    return camera.source.name.partition(".")[2]


def _video(folder: Path, rows: EpisodeRows, camera: CameraRows, bags: Bags, threads: int) -> int:
    with replaced_file(_file(folder, f"videos/{_short(camera)}", rows, "mp4")) as file:
        return write_video(file, rows.pictures(bags, camera), rows.rate, threads)


def _jpeg_tables(pa: Any, camera: CameraRows, found: Iterator[bytes]) -> Iterator[Any]:
    schema = pa.schema([("frame_index", pa.int64()), ("jpeg", pa.binary())])
    row = 0
    while cells := list(islice(found, _JPEGS)):
        kept = [None if camera.gaps[row + n] else cell for n, cell in enumerate(cells)]
        yield pa.table([list(range(row, row + len(cells))), kept], schema=schema)
        row += len(cells)


def _descriptions(rows: EpisodeRows) -> dict[str, dict[str, Any]]:
    """Return the settings of each signal that readers of the data need: its topic, names, unit and limits."""
    found = {}
    for each in rows.signals:
        source = each.source
        known: dict[str, Any] = {"topic": source.topic, "names": list(each.names), "unit": source.unit}
        known |= {"min": list(source.least), "max": list(source.most)}
        found[source.name] = {key: value for key, value in known.items() if value}
    return found
