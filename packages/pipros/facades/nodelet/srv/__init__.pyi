"""Services of nodelet, made from their definitions by `pipros stubs`."""

from typing import ClassVar as _ClassVar
from pipros.msg import base as _base

class NodeletListRequest(_base.Message):
    """Lists the nodelets in a manager, which offers it as MANAGER/list. The request is empty."""
    def __init__(self) -> None: ...

class NodeletListResponse(_base.Message):
    nodelets: list[str]
    """their names"""
    def __init__(self, nodelets: list[str] | None = ...) -> None: ...

class NodeletLoadRequest(_base.Message):
    """Loads a nodelet into a manager, which offers it as MANAGER/load_nodelet."""
    name: str
    """name of the nodelet"""
    type: str
    """PACKAGE/CLASS of the plugin"""
    remap_source_args: list[str]
    """names to remap"""
    remap_target_args: list[str]
    """new names, in the same order"""
    my_argv: list[str]
    """arguments of the nodelet"""
    bond_id: str
    """the bond with the loader, with which the nodelet ends; empty: none"""
    def __init__(self, name: str | None = ..., type: str | None = ..., remap_source_args: list[str] | None = ..., remap_target_args: list[str] | None = ..., my_argv: list[str] | None = ..., bond_id: str | None = ...) -> None: ...

class NodeletLoadResponse(_base.Message):
    success: bool
    """true if it is running"""
    def __init__(self, success: bool | None = ...) -> None: ...

class NodeletUnloadRequest(_base.Message):
    """Removes a nodelet from a manager, which offers it as MANAGER/unload_nodelet."""
    name: str
    """name of the nodelet"""
    def __init__(self, name: str | None = ...) -> None: ...

class NodeletUnloadResponse(_base.Message):
    success: bool
    """true if it existed and was removed"""
    def __init__(self, success: bool | None = ...) -> None: ...

class NodeletList:
    """Lists the nodelets in a manager, which offers it as MANAGER/list. The request is empty."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[NodeletListRequest]]
    _response_class: _ClassVar[type[NodeletListResponse]]

class NodeletLoad:
    """Loads a nodelet into a manager, which offers it as MANAGER/load_nodelet."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[NodeletLoadRequest]]
    _response_class: _ClassVar[type[NodeletLoadResponse]]

class NodeletUnload:
    """Removes a nodelet from a manager, which offers it as MANAGER/unload_nodelet."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[NodeletUnloadRequest]]
    _response_class: _ClassVar[type[NodeletUnloadResponse]]
