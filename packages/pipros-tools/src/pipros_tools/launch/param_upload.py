"""Sets a launch's parameters on the parameter server."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Any

from pipros.basics.errors import Refused
from pipros.basics.replaced_file import write_whole
from pipros.net.master_client import MasterClient
from pipros.wire.xmlrpc import PARAMETER_RULE
from pipros_tools.launch.model import Launch, LaunchError, ParameterAction, ParameterCommand

CALLER_ID = "/roslaunch"


def apply_parameters(launch: Launch, master_uri: str) -> None:
    """Run the dumps and deletions, delete the cleared namespaces, then set the parameters, in this order.

    Raises:
        Unreachable: the master does not answer.
        LaunchError: XML-RPC cannot represent a value, the master refuses it, or a dump cannot be written.
    """
    client = MasterClient(master_uri, CALLER_ID)
    try:
        upload(launch, client)
    finally:
        client.close()


def upload(launch: Launch, client: MasterClient) -> None:
    """Like `apply_parameters`, but use an open connection."""
    for command in launch.commands:
        _run(command, client)
    for namespace in launch.clear_params:
        _delete(client, namespace)
    for key, value in launch.params.items():
        _set(client, key, value)


def _run(command: ParameterCommand, client: MasterClient) -> None:
    if command.action is ParameterAction.DELETE:
        _delete(client, command.key)
        return
    import yaml

    tree: Any = {}
    with suppress(Refused):
        tree = client.get_param(command.key)
    text = yaml.safe_dump(tree)
    try:
        if command.file:
            write_whole(Path(command.file), text.encode())
        else:
            print(text, end="")
    except OSError as error:
        raise LaunchError(
            f"cannot dump the parameters of [{command.key}] to [{command.file}]: {error.strerror}"
        ) from None


def _delete(client: MasterClient, key: str) -> None:
    with suppress(Refused):  # the parameter does not exist
        client.delete_param(key)


def _set(client: MasterClient, key: str, value: Any) -> None:
    try:
        client.set_param(key, value)
    except (TypeError, OverflowError):
        raise LaunchError(f"cannot set the parameter [{key}] to {value!r}: {PARAMETER_RULE}") from None
    except ValueError as error:  # a character that XML forbids, such as NUL in the output of a command
        raise LaunchError(f"cannot set the parameter [{key}]: {error}") from None
    except Refused as error:
        raise LaunchError(f"the parameter [{key}] was not set: {error.text}") from None
