"""What `roscore` is: a master, its parameter server and the `/rosout` node, all in this process."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

from pipros.env import DEFAULT_MASTER_PORT, Environment

if TYPE_CHECKING:
    from pipros.master.log import MasterLog
    from pipros.master.server import Master
    from pipros.node.rosout import RosoutAggregator

ROS_DISTRO = "noetic"
ROS_COMM_VERSION = "1.15.15"
"""What `/rosversion` says: the ros_comm whose behaviour pipros has."""

STANDARD_PARAMETERS: dict[str, Any] = {
    # In genuine ROS these are outputs of commands, whose line ends are part of the value.
    "/rosdistro": f"{ROS_DISTRO}\n",
    "/rosversion": f"{ROS_COMM_VERSION}\n",
}


class Core:
    """A master and, unless it is left out, the `/rosout` node. No other process is started.

    A context manager: starts on the way in, stops on the way out. Several may run in one process.

    >>> with Core(port=0) as core:                                 # doctest: +SKIP
    ...     print(core.uri)
    http://127.0.0.1:40123/
    """

    def __init__(
        self,
        *,
        port: int = DEFAULT_MASTER_PORT,
        host: str | None = None,
        run_id: str | None = None,
        rosout: bool = True,
        log_folder: Path | None = None,
        environment: Environment | None = None,
        allow: Sequence[str] = (),
        store: Path | None = None,
        notice_timeout_s: float | None = None,
        master_logger_level: str | None = None,
        on_shutdown: Callable[[str], None] | None = None,
    ) -> None:
        """Nothing is opened yet.

        Args:
            port: 0 is a free one.
            host: the address to listen on; by default what the environment says, which is loopback
                as long as everything is local.
            run_id: made up when not given.
            rosout: whether the `/rosout` node runs.
            log_folder: where that node keeps `rosout.log`, and the master `master.log`; None for no files.
            master_logger_level: how much of `pipros.master.log.LEVELS` goes into the latter.
            allow, store, notice_timeout_s, on_shutdown: as of `Master`.
        """
        self._environment = environment or Environment.from_os()
        self.run_id = run_id or new_run_id()
        self._port = port
        self._host = host
        self._wants_rosout = rosout
        self._log_folder = log_folder
        self._allow = allow
        self._store = store
        self._notice_timeout_s = notice_timeout_s
        self._master_logger_level = master_logger_level
        self._on_shutdown = on_shutdown
        self._log: MasterLog | None = None
        self._master: Master | None = None
        self._rosout: RosoutAggregator | None = None

    @property
    def uri(self) -> str:
        """What nodes set as `ROS_MASTER_URI`. Valid while it runs."""
        if self._master is None:
            raise RuntimeError("the core is not running; call start() first")
        return self._master.uri

    @property
    def binding(self) -> str:
        """Who can connect, in words: `listens on 127.0.0.1, for this computer only`."""
        if self._master is None:
            raise RuntimeError("the core is not running; call start() first")
        return self._master.binding

    def start(self) -> None:
        """Starts the master, then `/rosout`.

        Raises:
            OSError: the port is taken, or the address is not of this computer.
        """
        self.start_master()
        if self._wants_rosout:
            try:
                self.start_rosout()
            except BaseException:
                self.stop()
                raise

    def start_master(self) -> None:
        """Starts the master alone; it answers when this returns."""
        from pipros.master.log import MasterLog
        from pipros.master.server import Master

        if self._log_folder is not None:
            self._log = MasterLog(self._log_folder / "master.log", self._master_logger_level)
        master = Master(
            host=self._host,
            port=self._port,
            environment=self._environment,
            allow=self._allow,
            store=self._store,
            notice_timeout_s=self._notice_timeout_s,
            on_shutdown=self._on_shutdown,
            parameters={**STANDARD_PARAMETERS, "/run_id": self.run_id},
        )
        master.start()
        self._master = master

    def start_rosout(self) -> None:
        """Starts the `/rosout` node; it repeats messages when this returns."""
        from pipros.node.rosout import RosoutAggregator

        environment = replace(self._environment, master_uri=self.uri, namespace="/")
        log_file = None if self._log_folder is None else self._log_folder / "rosout.log"
        rosout = RosoutAggregator(environment, log_file)
        rosout.start()
        self._rosout = rosout

    def stop_rosout(self) -> None:
        """Ends the `/rosout` node. Harmless when repeated."""
        rosout, self._rosout = self._rosout, None
        if rosout is not None:
            with suppress(OSError):
                rosout.stop()

    def stop(self) -> None:
        """Ends everything. Harmless when repeated."""
        self.stop_rosout()
        master, self._master = self._master, None
        if master is not None:
            master.stop()
        if self._log is not None:
            self._log.close()

    def __enter__(self) -> Core:
        self.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()


def new_run_id() -> str:
    """A name for one run of a ROS system, unlike any other."""
    import uuid

    return str(uuid.uuid1())
