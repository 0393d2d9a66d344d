"""`ROSLaunchParent`: launches files from a script."""

from __future__ import annotations

import time
from collections.abc import Sequence

from pipros.env import Environment
from pipros.launch.console import Console
from pipros.launch.load_context import LoadContext
from pipros.launch.model import Launch, Output
from pipros.launch.run import RunOptions
from pipros.launch.session import LaunchSession, SessionOptions
from pipros.launch.terminate import SIGINT_TIMEOUT_S, SIGTERM_TIMEOUT_S
from pipros.launch.xml import Loader
from pipros.master.options import MasterOptions, limits_with_timeout
from roslaunch.pmon import ProcessListener
from roslaunch.rlutil import FileAndArguments, split_file


class ROSLaunchParent:
    """One launch: `start()`, then `spin()` or `spin_once()`, then `shutdown()`."""

    def __init__(
        self,
        run_id: str,
        roslaunch_files: Sequence[FileAndArguments],
        is_core: bool = False,
        port: int | None = None,
        local_only: bool = False,
        process_listeners: Sequence[ProcessListener] | None = None,
        verbose: bool = False,
        force_screen: bool = False,
        force_log: bool = False,
        is_rostest: bool = False,
        roslaunch_strs: Sequence[str] | None = None,
        num_workers: int = 3,
        timeout: float | None = None,
        master_logger_level: object = False,
        show_summary: bool = True,
        force_required: bool = False,
        sigint_timeout: float = SIGINT_TIMEOUT_S,
        sigterm_timeout: float = SIGTERM_TIMEOUT_S,
    ) -> None:
        _ = is_rostest, num_workers, master_logger_level
        self.run_id = run_id
        self._ends_with_nodes = True
        self._is_over = False
        self._files = [split_file(entry) for entry in roslaunch_files]
        self._texts = list(roslaunch_strs or ())
        self._listeners = list(process_listeners or ())
        output = Output.SCREEN if force_screen else Output.LOG if force_log else None
        options = SessionOptions(
            is_core=is_core,
            port=port,
            run_id=run_id,
            has_summary=show_summary,
            checks_log_folder=False,
            master=MasterOptions(limits=limits_with_timeout(timeout)),
            run=RunOptions(
                output=output,
                all_required=force_required,
                local_only=local_only,
                sigint_timeout_s=sigint_timeout,
                sigterm_timeout_s=sigterm_timeout,
            ),
        )
        self.session = LaunchSession(
            [file for file, _ in self._files],
            {},
            options,
            Console(has_title=False, is_verbose=verbose),
            environment=Environment.from_os(),
            load_launch=self._load,
            on_end=self._tell_listeners,
        )

    def start(self, auto_terminate: bool = True) -> None:
        """Starts a master, unless one answers, sets the parameters and starts the nodes.

        Raises:
            RLException: a file is wrong; nothing is left running.
        """
        self._ends_with_nodes = auto_terminate
        try:
            self.session.start()
        except BaseException:
            self.shutdown()
            raise

    def spin_once(self) -> bool:
        """Handles the events since the last call; False when the launch is over."""
        if not self.session.run.poll():
            return False
        return self.session.owns_master or not self._ends_with_nodes or self.session.run.has_running

    def spin(self) -> None:
        """Waits until the launch is over, and ends what is left of it."""
        try:
            while self.spin_once():
                time.sleep(0.05)
        except KeyboardInterrupt:
            pass
        finally:
            self.shutdown()

    def shutdown(self) -> None:
        """Ends everything that was started. May be repeated."""
        if not self._is_over:
            self._is_over = True
            self.session.stop()

    def _load(self) -> Launch:
        loader = Loader(LoadContext.of_process(), {})
        for file, arguments in self._files:
            loader.arguments = dict(arguments)
            loader.load_file(file)
        loader.arguments = {}
        for text in self._texts:
            loader.load_text(text)
        return loader.finish()

    def _tell_listeners(self, name: str, exit_code: int) -> None:
        for listener in self._listeners:
            listener.process_died(name, exit_code)
