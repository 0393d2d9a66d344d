"""Module attributes that read and set the attributes of an object."""

from __future__ import annotations

import sys
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

from pipros.basics.shared_names import share_names


def test_a_module_reads_and_sets_attributes_of_an_object_and_its_parts(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    module: Any = ModuleType("sharing")
    monkeypatch.setitem(sys.modules, "sharing", module)
    owner = SimpleNamespace(uri="a", hooks=SimpleNamespace(client=[1]))
    share_names("sharing", owner, {"_uri": "uri", "_client": "hooks.client"})
    owner.hooks = SimpleNamespace(client=[2])
    assert (module._uri, module._client) == ("a", [2])
    module._uri, module._client = "b", [3]
    assert (owner.uri, owner.hooks.client) == ("b", [3])
