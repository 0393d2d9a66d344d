"""`roscore` as an object: a master, its parameter server and the `/rosout` node, all in this process."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from threading import Lock, Thread
from typing import TYPE_CHECKING, Any

from pipros.basics.env import Environment
from pipros.basics.errors import PiprosError
from pipros.master.options import MasterOptions
from pipros_tools.launch.run_id import new_run_id

if TYPE_CHECKING:
    from typing_extensions import Unpack

    from pipros.master.log import MasterLog
    from pipros.master.master import Master
    from pipros.master.options import MasterSettings
    from pipros.node.rosout import RosoutAggregator

ROS_DISTRO = "noetic"
ROS_COMM_VERSION = "1.15.15"
"""Value of `/rosversion`, the ros_comm release whose behaviour pipros follows."""

STANDARD_PARAMETERS: dict[str, Any] = {
    # The values end with a newline, because genuine ROS sets these parameters to the output of commands.
    "/rosdistro": f"{ROS_DISTRO}\n",
    "/rosversion": f"{ROS_COMM_VERSION}\n",
}


class Core:
    """A master and, by default, the `/rosout` node. Both run in this process.

    Used as a context manager, a core starts on entry and stops on exit. Several cores can run in one process.

    Examples:
        >>> with Core(port=0) as core:  # doctest: +SKIP
        ...     print(core.uri)
        http://127.0.0.1:40123/
    """

    def __init__(
        self,
        options: MasterOptions | None = None,
        *,
        run_id: str | None = None,
        rosout: bool = True,
        log_folder: Path | None = None,
        environment: Environment | None = None,
        **settings: Unpack[MasterSettings],
    ) -> None:
        """Store the settings; `start` opens the port.

        Args:
            options: the master's settings in one object.
            run_id: id of the run; by default, a new id.
            rosout: whether to run the `/rosout` node.
            log_folder: folder for the node's `rosout.log` and the master's `master.log`; None for no files.
            environment: defaults to `os.environ`.
            settings: fields of `MasterOptions` that override `options`: `port`, `host`, `allow`, …
        """
        self._environment = environment or Environment.from_os()
        self.run_id = run_id or new_run_id()
        self._options = replace(options or MasterOptions(), **settings)
        self._has_rosout = rosout
        self._log_folder = log_folder
        self._log: MasterLog | None = None
        self._master: Master | None = None
        self._rosout: RosoutAggregator | None = None
        self._respawning = Lock()

    @property
    def uri(self) -> str:
        """The `ROS_MASTER_URI` for nodes. Valid while the core runs."""
        if self._master is None:
            raise RuntimeError("the core is not running; call start() first")
        return self._master.uri

    @property
    def binding(self) -> str:
        """A description of who can connect, such as `listens on 127.0.0.1, for this computer only`."""
        if self._master is None:
            raise RuntimeError("the core is not running; call start() first")
        return self._master.binding

    def start(self) -> None:
        """Start the master, then `/rosout`.

        Raises:
            OSError: the port is in use, or the address does not belong to this computer.
        """
        self.start_master()
        if self._has_rosout:
            try:
                self.start_rosout()
            except BaseException:
                self.stop()
                raise

    def start_master(self) -> None:
        """Start only the master. It accepts calls by the time this method returns."""
        from pipros.master.log import MasterLog
        from pipros.master.master import Master

        if self._log_folder is not None:
            self._log = MasterLog(
                self._log_folder / "master.log", self._options.log_level, limits=self._options.limits
            )
        try:
            parameters = {**self._options.parameters, **STANDARD_PARAMETERS, "/run_id": self.run_id}
            master = Master(replace(self._options, parameters=parameters), environment=self._environment)
            master.start()
        except BaseException:
            self.stop()
            raise
        self._master = master

    def start_rosout(self) -> None:
        """Start the `/rosout` node. It is ready when this method returns."""
        from pipros.node.rosout import RosoutAggregator

        environment = self._environment._replace(master_uri=self.uri, namespace="/")
        log_file = None if self._log_folder is None else self._log_folder / "rosout.log"
        rosout = RosoutAggregator(environment, log_file)
        rosout.start()
        self._rosout = rosout
        rosout.node.on_shutdown(lambda: Thread(target=self._respawn, args=[rosout], daemon=True).start())

    def _respawn(self, ended: RosoutAggregator) -> None:
        """Replace a `/rosout` that others shut down, for example `rosnode kill -a`."""
        ended.stop()
        with self._respawning, suppress(OSError, PiprosError):
            if self._rosout is ended:
                self.start_rosout()

    def stop_rosout(self) -> None:
        """Stop the `/rosout` node. May be called repeatedly."""
        with self._respawning:
            rosout, self._rosout = self._rosout, None
        if rosout is not None:
            with suppress(OSError):
                rosout.stop()

    def stop(self) -> None:
        """Stop `/rosout` and the master. May be called repeatedly."""
        self.stop_rosout()
        master, self._master = self._master, None
        if master is not None:
            master.stop()
        log, self._log = self._log, None
        if log is not None:
            log.close()

    def __enter__(self) -> Core:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()
