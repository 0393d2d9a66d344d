"""`LogExporter`, which exports a bag's diagnostics to CSV files."""

from __future__ import annotations

import shutil
from collections import defaultdict
from collections.abc import Iterator
from contextlib import ExitStack as _ExitStack
from pathlib import Path

from pipros.basics.lazy_names import star_names as _star_names
from pipros.basics.replaced_file import cleared as _cleared
from pipros.basics.replaced_file import naming as _naming
from pipros.basics.windows import replace_file as _replace_file
from pipros_libraries.diagnostics.csv_rows import CsvColumns, file_names
from pipros_libraries.diagnostics.items import ComponentStatus
from pipros_tools.bag import open_bag

_star_names(__name__, "diagnostic_msgs operator os rosbag roslib subprocess sys tempfile time")

_ROWS_AT_ONCE = 1000
_TOPIC = "/diagnostics"


class LogExporter:
    """Writes one file for each status name on `/diagnostics`.

    Attributes:
        logfile: path to the bag.
        output_dir: the output folder. For `name.bag`, it is the subfolder `name_csv` of the given folder.
    """

    def __init__(self, output_dir: str, logfile: str) -> None:
        """Create the output folder."""
        self.logfile = logfile
        self.output_dir = str(Path(output_dir) / f"{Path(logfile).stem}_csv")
        self._files: dict[str, str] = {}
        Path(self.output_dir).mkdir(parents=True, exist_ok=True)

    def process_log(self) -> None:
        """Read the bag and write the files.

        Raises:
            OSError, pipros_tools.bag.BagError: the bag cannot be read, or a file cannot be written. Files of
                an earlier export stay as they were.
        """
        with _ExitStack() as unfinished:
            self._write_files(unfinished)
            for name in self._files:
                _replace_file(self._unfinished(name), self._path(name))

    def _write_files(self, unfinished: _ExitStack) -> None:
        columns: dict[str, CsvColumns] = defaultdict(CsvColumns)
        for _, status in self._statuses():
            columns[status.name].add(status)
        self._files = file_names(columns)
        for name, found in columns.items():
            unfinished.callback(_cleared(self._unfinished(name)).unlink, missing_ok=True)
            self._append(name, [found.header()])
        so_far: dict[str, CsvColumns] = defaultdict(CsvColumns)
        rows: dict[str, list[str]] = defaultdict(list)
        for stamp_s, status in self._statuses():
            rows[status.name].append(so_far[status.name].row(status, stamp_s))
            if len(rows[status.name]) >= _ROWS_AT_ONCE:
                self._append(status.name, rows.pop(status.name))
        for name, lines in rows.items():
            self._append(name, lines)

    def finish_logfile(self) -> None:
        """Do nothing, because `process_log` has already written the files."""

    def remove_files(self) -> None:
        """Remove the output folder."""
        shutil.rmtree(self.output_dir, ignore_errors=True)

    def get_filename(self, name: str) -> str | None:
        """Return the path of the file for a status name.

        Return None if the bag does not contain the name, or `process_log` has not been called.
        """
        return str(self._path(name)) if name in self._files else None

    def _path(self, name: str) -> Path:
        return Path(self.output_dir) / self._files[name]

    def _append(self, name: str, lines: list[str]) -> None:
        with _naming(self._path(name)), self._unfinished(name).open("a", encoding="utf-8") as file:
            file.writelines(lines)

    def _unfinished(self, name: str) -> Path:
        return Path(f"{self._path(name)}.active")

    def _statuses(self) -> Iterator[tuple[float, ComponentStatus]]:
        with open_bag(self.logfile) as bag:
            for message in bag.messages([_TOPIC]):
                array = message.message
                for item in array.status:
                    values = tuple((pair.key, pair.value) for pair in item.values)
                    status = ComponentStatus(item.name, item.level, item.message, item.hardware_id, values)
                    yield array.header.stamp.to_sec(), status
