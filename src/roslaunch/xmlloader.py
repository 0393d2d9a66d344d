"""`XmlLoader`: reads launch files into a `ROSLaunchConfig`."""

from __future__ import annotations

from collections.abc import Sequence

from pipros.launch.arguments import split_arguments
from pipros.launch.xml import load
from roslaunch.config import ROSLaunchConfig
from roslaunch.core import RLException

XmlParseException = RLException


class XmlLoader:
    """Reads files one by one into a configuration."""

    def __init__(self, resolve_anon: bool = True, args_only: bool = False) -> None:
        _ = resolve_anon, args_only
        self.ignore_unset_args = False

    def load(
        self,
        filename: str,
        ros_config: ROSLaunchConfig,
        core: bool = False,
        argv: Sequence[str] | None = None,
        verbose: bool = True,
    ) -> None:
        """Reads a file. Raises XmlParseException with file, line and element."""
        _ = core, verbose
        arguments, _ = split_arguments(list(argv or ()))
        ros_config.add(load([filename], arguments, unset_as="" if self.ignore_unset_args else None))

    def load_string(
        self, xml_text: str, ros_config: ROSLaunchConfig, core: bool = False, verbose: bool = True
    ) -> None:
        """Reads a text."""
        _ = core, verbose
        ros_config.add(load([], texts=[xml_text], unset_as="" if self.ignore_unset_args else None))
