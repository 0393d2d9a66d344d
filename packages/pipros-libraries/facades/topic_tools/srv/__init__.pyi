"""Services of topic_tools, made from their definitions by `pipros stubs`."""

from typing import ClassVar as _ClassVar
from pipros.msg import base as _base

class DemuxAddRequest(_base.Message):
    """Adds an output topic to a demux. The response is empty; the call fails if it has the topic already."""
    topic: str
    """the topic to add"""
    def __init__(self, topic: str | None = ...) -> None: ...

class DemuxAddResponse(_base.Message):
    def __init__(self) -> None: ...

class DemuxDeleteRequest(_base.Message):
    """Removes an output topic from a demux. The response is empty; the call fails if it is the selected one."""
    topic: str
    """the topic to remove"""
    def __init__(self, topic: str | None = ...) -> None: ...

class DemuxDeleteResponse(_base.Message):
    def __init__(self) -> None: ...

class DemuxListRequest(_base.Message):
    """Lists the output topics of a demux. The request is empty."""
    def __init__(self) -> None: ...

class DemuxListResponse(_base.Message):
    topics: list[str]
    """all of them, including the selected topic"""
    def __init__(self, topics: list[str] | None = ...) -> None: ...

class DemuxSelectRequest(_base.Message):
    """Selects the topic on which a demux publishes what it receives."""
    topic: str
    """one of its output topics, or __none to publish nowhere"""
    def __init__(self, topic: str | None = ...) -> None: ...

class DemuxSelectResponse(_base.Message):
    prev_topic: str
    """the topic that was selected before"""
    def __init__(self, prev_topic: str | None = ...) -> None: ...

class MuxAddRequest(_base.Message):
    """Adds an input topic to a mux. The response is empty; the call fails if it has the topic already."""
    topic: str
    """the topic to add"""
    def __init__(self, topic: str | None = ...) -> None: ...

class MuxAddResponse(_base.Message):
    def __init__(self) -> None: ...

class MuxDeleteRequest(_base.Message):
    """Removes an input topic from a mux. The response is empty; the call fails if it is the selected one."""
    topic: str
    """the topic to remove"""
    def __init__(self, topic: str | None = ...) -> None: ...

class MuxDeleteResponse(_base.Message):
    def __init__(self) -> None: ...

class MuxListRequest(_base.Message):
    """Lists the input topics of a mux. The request is empty."""
    def __init__(self) -> None: ...

class MuxListResponse(_base.Message):
    topics: list[str]
    """all of them, including the selected topic"""
    def __init__(self, topics: list[str] | None = ...) -> None: ...

class MuxSelectRequest(_base.Message):
    """Selects the topic whose messages a mux forwards."""
    topic: str
    """one of its input topics, or __none to forward nothing"""
    def __init__(self, topic: str | None = ...) -> None: ...

class MuxSelectResponse(_base.Message):
    prev_topic: str
    """the topic that was selected before"""
    def __init__(self, prev_topic: str | None = ...) -> None: ...

class DemuxAdd:
    """Adds an output topic to a demux. The response is empty; the call fails if it has the topic already."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[DemuxAddRequest]]
    _response_class: _ClassVar[type[DemuxAddResponse]]

class DemuxDelete:
    """Removes an output topic from a demux. The response is empty; the call fails if it is the selected one."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[DemuxDeleteRequest]]
    _response_class: _ClassVar[type[DemuxDeleteResponse]]

class DemuxList:
    """Lists the output topics of a demux. The request is empty."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[DemuxListRequest]]
    _response_class: _ClassVar[type[DemuxListResponse]]

class DemuxSelect:
    """Selects the topic on which a demux publishes what it receives."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[DemuxSelectRequest]]
    _response_class: _ClassVar[type[DemuxSelectResponse]]

class MuxAdd:
    """Adds an input topic to a mux. The response is empty; the call fails if it has the topic already."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[MuxAddRequest]]
    _response_class: _ClassVar[type[MuxAddResponse]]

class MuxDelete:
    """Removes an input topic from a mux. The response is empty; the call fails if it is the selected one."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[MuxDeleteRequest]]
    _response_class: _ClassVar[type[MuxDeleteResponse]]

class MuxList:
    """Lists the input topics of a mux. The request is empty."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[MuxListRequest]]
    _response_class: _ClassVar[type[MuxListResponse]]

class MuxSelect:
    """Selects the topic whose messages a mux forwards."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[MuxSelectRequest]]
    _response_class: _ClassVar[type[MuxSelectResponse]]
