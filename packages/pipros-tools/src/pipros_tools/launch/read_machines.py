"""Reads the `<machine>` elements of launch files."""

from __future__ import annotations

from pipros_tools.launch.model import Machine
from pipros_tools.launch.reader import ElementReader

_BEFORE_FUERTE = ("ros-root", "ros-package-path", "ros-ip", "ros-hostname")


def read_machine(reader: ElementReader) -> None:
    """Read a `<machine>`, and add it to the launch.

    A default machine becomes the machine of later nodes without a `machine` attribute.
    """
    if any(map(reader.text, _BEFORE_FUERTE)):
        raise reader.error(
            "<machine>: ros-* attributes are not supported since ROS Fuerte.\nPlease use env-loader instead."
        )
    if reader.element.first("env") is not None:
        raise reader.error(
            "<machine>: <env> tag is not supported since ROS Fuerte.\nPlease use env-loader instead."
        )
    for child in reader.children():
        reader.warn(f"unrecognized '{child.tag}' tag in <machine> tag in {child.place}")
    reader.allow("name", "address", "ssh-port", "env-loader", "user", "password", "default", "timeout")
    default = (reader.text("default") or "false").lower()
    if default not in ("true", "false", "never"):
        raise reader.error(f"Invalid value for 'attribute': {default}")
    if not reader.required("name"):
        raise reader.error("a machine's name must be non-empty")
    machine = Machine(
        name=reader.required("name"),
        address=reader.required("address"),
        user=reader.text("user") or "",
        password=reader.text("password") or "",
        ssh_port=_ssh_port(reader),
        env_loader=reader.text("env-loader") or "",
        timeout_s=reader.positive("timeout", 10.0),
        is_default=default == "true",
        place=reader.place,
    )
    reader.builder.add_machine(machine)
    if machine.is_default:
        reader.scope.default_machine = machine.name


def _ssh_port(reader: ElementReader) -> int:
    text = (reader.text("ssh-port") or "22").strip()
    if not text.isdecimal() or not 0 < int(text) < 65536:
        raise reader.error(f"'ssh-port' must be a port number: [{text}]")
    return int(text)
