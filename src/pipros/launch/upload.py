"""Carries the parameters of a launch to the parameter server."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Any

from pipros.errors import Refused
from pipros.launch.model import Launch, LaunchError, ParameterAction, ParameterCommand
from pipros.net.master import MasterClient

CALLER_ID = "/roslaunch"


def apply_parameters(launch: Launch, master_uri: str) -> None:
    """Dumps and deletes, clears, then sets, in this order and one after another.

    Raises:
        Unreachable: the master is gone.
        LaunchError: a value that no parameter server can hold, or a dump that cannot be written.
    """
    client = MasterClient(master_uri, CALLER_ID)
    try:
        for command in launch.commands:
            _carry_out(command, client)
        for namespace in launch.clear_params:
            _delete(client, namespace)
        for key, value in launch.params.items():
            _set(client, key, value)
    finally:
        client.close()


def _carry_out(command: ParameterCommand, client: MasterClient) -> None:
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
            Path(command.file).write_text(text, "utf-8")
        else:
            print(text, end="")
    except OSError as error:
        raise LaunchError(
            f"cannot dump the parameters of [{command.key}] to [{command.file}]: {error.strerror}"
        ) from None


def _delete(client: MasterClient, key: str) -> None:
    # What is not there need not be deleted.
    with suppress(Refused):
        client.delete_param(key)


def _set(client: MasterClient, key: str, value: Any) -> None:
    try:
        client.set_param(key, value)
    except (TypeError, OverflowError) as error:
        raise LaunchError(f"the parameter [{key}] cannot have the value {value!r}: {error}") from None
    except Refused as error:
        raise LaunchError(f"the parameter [{key}] was not set: {error.text}") from None
