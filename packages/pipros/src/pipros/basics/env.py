"""The `ROS_*` environment variables, read in one place."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from pipros.basics.graph_variables import (
    DEFAULT_MASTER_PORT,
    DEFAULT_MASTER_URI,
    InvalidEnvironment,
    master_uri_of,
    namespace_of,
    split_master_uri,
)
from pipros.basics.home import expanded

if TYPE_CHECKING:
    from pipros.basics.ports import AdvertisedAddress, PortRange

__all__ = [
    "DEFAULT_MASTER_PORT",
    "DEFAULT_MASTER_URI",
    "DISTRIBUTION",
    "Environment",
    "InvalidEnvironment",
    "split_master_uri",
]

DISTRIBUTION: Mapping[str, str] = {"ROS_DISTRO": "noetic", "ROS_VERSION": "1", "ROS_PYTHON_VERSION": "3"}
"""The variables to which Noetic's setup files assign the same values on every machine."""


# Every node imports this module. Importing dataclasses, or string annotations here, would take 3 ms.
class Environment(NamedTuple):
    """The ROS environment variables of a process, and pipros's own variables for ports and addresses.

    `environment._replace(namespace="/")` returns a changed copy.

    Attributes:
        master_uri: `ROS_MASTER_URI`.
        hostname: `ROS_HOSTNAME`, the name to advertise; takes precedence over `ip`.
        ip: `ROS_IP`, the address to advertise.
        ipv6: whether `ROS_IPV6` is `on`.
        namespace: `ROS_NAMESPACE` with a leading and trailing slash; `/` if unset.
        package_path: the folders in `ROS_PACKAGE_PATH`; the first takes precedence.
        ros_home: `ROS_HOME`, or `~/.ros` if unset. A leading `~` is expanded, as in `log_dir`,
            `test_results_dir` and `python_log_config`.
        log_dir: `ROS_LOG_DIR`, or `<ros_home>/log` if unset.
        test_results_dir: `ROS_TEST_RESULTS_DIR`, or `<ros_home>/test_results` if unset.
        console_format: `ROSCONSOLE_FORMAT`; None if unset.
        python_log_config: `ROS_PYTHON_LOG_CONFIG_FILE`; None if unset.
        ports: `PIPROS_PORTS`; None if unset. `port_range` parses it.
        advertise: `PIPROS_ADVERTISE`; None if unset. `advertised_address` parses it.
    """

    master_uri: str = DEFAULT_MASTER_URI
    hostname: str | None = None
    ip: str | None = None
    ipv6: bool = False
    namespace: str = "/"
    package_path: tuple[Path, ...] = ()
    ros_home: Path = Path(expanded("~/.ros"))
    log_dir: Path = Path(expanded("~/.ros/log"))
    test_results_dir: Path = Path(expanded("~/.ros/test_results"))
    console_format: str | None = None
    python_log_config: Path | None = None
    ports: str | None = None
    advertise: str | None = None

    @classmethod
    def from_os(cls, variables: Mapping[str, str] | None = None) -> "Environment":
        """Read `variables`; defaults to `os.environ` at the time of the call."""
        variables = os.environ if variables is None else variables
        get = variables.get
        home = Path(expanded(get("ROS_HOME") or "~/.ros"))
        return cls(
            master_uri=master_uri_of(variables),
            hostname=(get("ROS_HOSTNAME") or "").strip() or None,
            ip=(get("ROS_IP") or "").strip() or None,
            ipv6=get("ROS_IPV6") == "on",
            namespace=namespace_of(variables),
            package_path=tuple(
                Path(folder) for folder in (get("ROS_PACKAGE_PATH") or "").split(os.pathsep) if folder
            ),
            ros_home=home,
            log_dir=_path(get("ROS_LOG_DIR")) or home / "log",
            test_results_dir=_path(get("ROS_TEST_RESULTS_DIR")) or home / "test_results",
            console_format=get("ROSCONSOLE_FORMAT") or None,
            python_log_config=_path(get("ROS_PYTHON_LOG_CONFIG_FILE")),
            ports=get("PIPROS_PORTS") or None,
            advertise=get("PIPROS_ADVERTISE") or None,
        )

    def applied_to(self, variables: Mapping[str, str]) -> dict[str, str]:
        """Return `variables`, changed to use the master, the addresses and the ports of this environment.

        A program with these variables connects to the same ROS system in the same way.
        """
        own = {
            "ROS_MASTER_URI": self.master_uri,
            "ROS_HOSTNAME": self.hostname,
            "ROS_IP": self.ip,
            "ROS_IPV6": "on" if self.ipv6 else None,
            "PIPROS_PORTS": self.ports,
            "PIPROS_ADVERTISE": self.advertise,
        }
        others = {name: value for name, value in variables.items() if name not in own}
        return {**others, **{name: value for name, value in own.items() if value}}

    @property
    def port_range(self) -> "PortRange | None":
        """The ports that nodes may open; None if nodes may open any port.

        Raises:
            InvalidEnvironment: see `PortRange.parse`.
        """
        from pipros.basics.ports import PortRange  # imported here, because the variable is rarely set

        return PortRange.parse(self.ports) if self.ports else None

    def advertised_address(self, ports: "PortRange | None" = None) -> "AdvertisedAddress | None":
        """Return the address in `PIPROS_ADVERTISE`, at which peers reach this process, or None if unset.

        `ports` are the ports that nodes may open; defaults to `port_range`.

        Raises:
            InvalidEnvironment: see `AdvertisedAddress.parse`.
        """
        from pipros.basics.ports import AdvertisedAddress

        if not self.advertise:
            return None
        return AdvertisedAddress.parse(self.advertise, ports or self.port_range)


def _path(text: str | None) -> Path | None:
    return Path(expanded(text)) if text else None
