"""Check the ports and addresses that programs use in containers and behind routers. Performs no I/O."""

from __future__ import annotations

from pipros.basics.env import Environment, InvalidEnvironment
from pipros.basics.ports import AdvertisedAddress, PortRange
from pipros.net.address import is_loopback
from pipros_tools.health.finding import Findings, error, warning
from pipros_tools.health.machine import MachineReport

EXAMPLE_PORTS = "11400-11420"


def ports_and_advertised_address(machine: MachineReport) -> Findings:
    """Check `PIPROS_PORTS` and `PIPROS_ADVERTISE`, and that nodes listen on a reachable address."""
    environment = Environment.from_os(machine.variables)
    try:
        ports = environment.port_range
    except InvalidEnvironment as problem:
        yield error("port-range", str(problem), f"export PIPROS_PORTS={EXAMPLE_PORTS}", "PIPROS_PORTS")
        return
    if machine.port_problem:
        yield error(
            "ports-taken",
            f"A node cannot start: {machine.port_problem}",
            "Widen PIPROS_PORTS (in a container also the ports that are mapped), or end some programs.",
            "PIPROS_PORTS",
        )
    try:
        advertised = environment.advertised_address()
    except InvalidEnvironment as problem:
        yield error(
            "advertised-form",
            str(problem),
            f"export PIPROS_PORTS={EXAMPLE_PORTS} PIPROS_ADVERTISE=ADDRESS, the address by which the others "
            "reach this machine.",
            "PIPROS_ADVERTISE",
        )
        return
    if advertised is not None:
        yield from _advertised_address(machine, ports, advertised)


def _advertised_address(
    machine: MachineReport, ports: PortRange | None, advertised: AdvertisedAddress
) -> Findings:
    """Check that the advertised address is known, and that its ports and interface receive connections."""
    if machine.resolved.get(advertised.host) == ():
        yield warning(
            "advertised-unknown",
            f"The host [{advertised.host}] of PIPROS_ADVERTISE cannot be resolved to an address here",
            "Advertise an address, or make sure that every other machine can resolve the name.",
            "PIPROS_ADVERTISE",
            advertised.host,
        )
    if ports is None:
        yield error(
            "advertised-any-port",
            "PIPROS_ADVERTISE is set, but nodes open random ports, which no container or router maps",
            f"export PIPROS_PORTS={EXAMPLE_PORTS}, and map these ports.",
            "PIPROS_PORTS",
        )
        return
    mapped = [inner for _, inner in advertised.ports] or [ports]
    unmapped = [port for port in ports if not any(port in inner for inner in mapped)]
    if unmapped:
        yield warning(
            "unmapped-port",
            f"PIPROS_ADVERTISE maps no outer port to {len(unmapped)} ports in PIPROS_PORTS [{ports}]; the "
            f"first is {unmapped[0]}",
            "List and map all of them, or shorten PIPROS_PORTS.",
            "PIPROS_ADVERTISE",
            "PIPROS_PORTS",
        )
    if is_loopback(machine.bound_host) and not is_loopback(advertised.host):
        yield warning(
            "advertised-not-bound",
            f"PIPROS_ADVERTISE [{advertised.host}] is set, but nodes listen on {machine.bound_host} only: "
            "connections that a container or a router passes on do not arrive",
            "export ROS_IP=ADDRESS, this machine's inner address, and start `roscore --bind 0.0.0.0`.",
            "ROS_IP",
        )


def master_calls_back(machine: MachineReport) -> Findings:
    """Check that the master can connect to the address that programs on this machine advertise."""
    if not machine.not_called_back:
        return
    # urlsplit() rejects a URI of an invalid ROS_IP, such as http://[10.0.0.2:11311]:40000/
    host = machine.not_called_back.partition("://")[2].rpartition(":")[0].strip("[]")
    good = machine.address_towards_master
    mapping = (
        f"In a container or behind a router, map ports to it and export PIPROS_PORTS={EXAMPLE_PORTS} "
        "PIPROS_ADVERTISE=ADDRESS, its outer address. Genuine nodes there can be reached only if the "
        "container uses the host's network."
    )
    example = f", such as {good}" if good else ""
    cure = f"Set ROS_IP to an address of this machine that the master's machine can reach{example}. {mapping}"
    if host == good:
        cure = (
            "The address is right, so a firewall drops incoming connections: let it pass TCP from the other "
            "machines (`sudo ufw allow from ADDRESS`, firewall-cmd, nft or iptables), or export "
            f"PIPROS_PORTS={EXAMPLE_PORTS} and let it pass these ports. {mapping}"
        )
    yield error(
        "not-called-back",
        f"The master did not connect to [{machine.not_called_back}], the address that programs of this "
        "machine advertise: others cannot reach them either",
        cure,
        "PIPROS_ADVERTISE",
    )
