"""Services of rosapi, made from their definitions by `pipros stubs`."""

from typing import ClassVar as _ClassVar
from pipros.msg import base as _base
from pipros.msg import time as _time
import rosapi.msg

class DeleteParamRequest(_base.Message):
    """Deletes a parameter; does nothing if there is none."""
    name: str
    """of the parameter"""
    def __init__(self, name: str | None = ...) -> None: ...

class DeleteParamResponse(_base.Message):
    def __init__(self) -> None: ...

class GetActionServersRequest(_base.Message):
    """Lists the actions that have all five topics."""
    def __init__(self) -> None: ...

class GetActionServersResponse(_base.Message):
    action_servers: list[str]
    """names of the actions"""
    def __init__(self, action_servers: list[str] | None = ...) -> None: ...

class GetParamRequest(_base.Message):
    """Returns a parameter as JSON text."""
    name: str
    """of the parameter"""
    default: str
    """JSON text to return if there is no such parameter"""
    def __init__(self, name: str | None = ..., default: str | None = ...) -> None: ...

class GetParamResponse(_base.Message):
    value: str
    """JSON text; null without a parameter and a default"""
    def __init__(self, value: str | None = ...) -> None: ...

class GetParamNamesRequest(_base.Message):
    """Lists the names of all parameters."""
    def __init__(self) -> None: ...

class GetParamNamesResponse(_base.Message):
    names: list[str]
    """global names"""
    def __init__(self, names: list[str] | None = ...) -> None: ...

class GetTimeRequest(_base.Message):
    """Returns the present time of the node, which may be simulated."""
    def __init__(self) -> None: ...

class GetTimeResponse(_base.Message):
    time: _time.Time
    """now"""
    def __init__(self, time: _time.Time | None = ...) -> None: ...

class HasParamRequest(_base.Message):
    """Tells whether a parameter exists."""
    name: str
    """of the parameter"""
    def __init__(self, name: str | None = ...) -> None: ...

class HasParamResponse(_base.Message):
    exists: bool
    """true if it does"""
    def __init__(self, exists: bool | None = ...) -> None: ...

class MessageDetailsRequest(_base.Message):
    """Describes a message type and all types in it."""
    type: str
    """package/Name"""
    def __init__(self, type: str | None = ...) -> None: ...

class MessageDetailsResponse(_base.Message):
    typedefs: list[rosapi.msg.TypeDef]
    """the type itself first"""
    def __init__(self, typedefs: list[rosapi.msg.TypeDef] | None = ...) -> None: ...

class NodeDetailsRequest(_base.Message):
    """Lists the topics and services of a node."""
    node: str
    """its name"""
    def __init__(self, node: str | None = ...) -> None: ...

class NodeDetailsResponse(_base.Message):
    subscribing: list[str]
    """topics that it receives"""
    publishing: list[str]
    """topics that it publishes"""
    services: list[str]
    """services that it offers"""
    def __init__(self, subscribing: list[str] | None = ..., publishing: list[str] | None = ..., services: list[str] | None = ...) -> None: ...

class NodesRequest(_base.Message):
    """Lists the nodes of the system."""
    def __init__(self) -> None: ...

class NodesResponse(_base.Message):
    nodes: list[str]
    """names"""
    def __init__(self, nodes: list[str] | None = ...) -> None: ...

class PublishersRequest(_base.Message):
    """Lists the nodes that publish a topic."""
    topic: str
    """global name"""
    def __init__(self, topic: str | None = ...) -> None: ...

class PublishersResponse(_base.Message):
    publishers: list[str]
    """names of nodes"""
    def __init__(self, publishers: list[str] | None = ...) -> None: ...

class SearchParamRequest(_base.Message):
    """Searches the namespaces of the node for a parameter, innermost first."""
    name: str
    """without a namespace"""
    def __init__(self, name: str | None = ...) -> None: ...

class SearchParamResponse(_base.Message):
    global_name: str
    """empty if there is none"""
    def __init__(self, global_name: str | None = ...) -> None: ...

class ServiceHostRequest(_base.Message):
    """Returns the host that offers a service."""
    service: str
    """global name"""
    def __init__(self, service: str | None = ...) -> None: ...

class ServiceHostResponse(_base.Message):
    host: str
    """name or address"""
    def __init__(self, host: str | None = ...) -> None: ...

class ServiceNodeRequest(_base.Message):
    """Returns the node that offers a service."""
    service: str
    """global name"""
    def __init__(self, service: str | None = ...) -> None: ...

class ServiceNodeResponse(_base.Message):
    node: str
    """empty if there is none"""
    def __init__(self, node: str | None = ...) -> None: ...

class ServiceProvidersRequest(_base.Message):
    """Lists the nodes that offer services of a type."""
    service: str
    """package/Name of the type"""
    def __init__(self, service: str | None = ...) -> None: ...

class ServiceProvidersResponse(_base.Message):
    providers: list[str]
    """names of nodes"""
    def __init__(self, providers: list[str] | None = ...) -> None: ...

class ServiceRequestDetailsRequest(_base.Message):
    """Describes the request of a service type and all types in it."""
    type: str
    """package/Name of the service"""
    def __init__(self, type: str | None = ...) -> None: ...

class ServiceRequestDetailsResponse(_base.Message):
    typedefs: list[rosapi.msg.TypeDef]
    """the request itself first"""
    def __init__(self, typedefs: list[rosapi.msg.TypeDef] | None = ...) -> None: ...

class ServiceResponseDetailsRequest(_base.Message):
    """Describes the response of a service type and all types in it."""
    type: str
    """package/Name of the service"""
    def __init__(self, type: str | None = ...) -> None: ...

class ServiceResponseDetailsResponse(_base.Message):
    typedefs: list[rosapi.msg.TypeDef]
    """the response itself first"""
    def __init__(self, typedefs: list[rosapi.msg.TypeDef] | None = ...) -> None: ...

class ServiceTypeRequest(_base.Message):
    """Returns the type of a service."""
    service: str
    """global name"""
    def __init__(self, service: str | None = ...) -> None: ...

class ServiceTypeResponse(_base.Message):
    type: str
    """package/Name, or empty"""
    def __init__(self, type: str | None = ...) -> None: ...

class ServicesRequest(_base.Message):
    """Lists the services of the system."""
    def __init__(self) -> None: ...

class ServicesResponse(_base.Message):
    services: list[str]
    """global names"""
    def __init__(self, services: list[str] | None = ...) -> None: ...

class ServicesForTypeRequest(_base.Message):
    """Lists the services of a type."""
    type: str
    """package/Name"""
    def __init__(self, type: str | None = ...) -> None: ...

class ServicesForTypeResponse(_base.Message):
    services: list[str]
    """global names"""
    def __init__(self, services: list[str] | None = ...) -> None: ...

class SetParamRequest(_base.Message):
    """Sets a parameter."""
    name: str
    """of the parameter"""
    value: str
    """JSON text"""
    def __init__(self, name: str | None = ..., value: str | None = ...) -> None: ...

class SetParamResponse(_base.Message):
    def __init__(self) -> None: ...

class SubscribersRequest(_base.Message):
    """Lists the nodes that receive a topic."""
    topic: str
    """global name"""
    def __init__(self, topic: str | None = ...) -> None: ...

class SubscribersResponse(_base.Message):
    subscribers: list[str]
    """names of nodes"""
    def __init__(self, subscribers: list[str] | None = ...) -> None: ...

class TopicTypeRequest(_base.Message):
    """Returns the type of a topic."""
    topic: str
    """global name"""
    def __init__(self, topic: str | None = ...) -> None: ...

class TopicTypeResponse(_base.Message):
    type: str
    """package/Name, or empty"""
    def __init__(self, type: str | None = ...) -> None: ...

class TopicsRequest(_base.Message):
    """Lists the topics of the system with their types."""
    def __init__(self) -> None: ...

class TopicsResponse(_base.Message):
    topics: list[str]
    """global names"""
    types: list[str]
    """package/Name of each"""
    def __init__(self, topics: list[str] | None = ..., types: list[str] | None = ...) -> None: ...

class TopicsAndRawTypesRequest(_base.Message):
    """Lists the topics of the system with their types and definitions."""
    def __init__(self) -> None: ...

class TopicsAndRawTypesResponse(_base.Message):
    topics: list[str]
    """global names"""
    types: list[str]
    """package/Name of each"""
    typedefs_full_text: list[str]
    """full definition of each"""
    def __init__(self, topics: list[str] | None = ..., types: list[str] | None = ..., typedefs_full_text: list[str] | None = ...) -> None: ...

class TopicsForTypeRequest(_base.Message):
    """Lists the topics of a type."""
    type: str
    """package/Name"""
    def __init__(self, type: str | None = ...) -> None: ...

class TopicsForTypeResponse(_base.Message):
    topics: list[str]
    """global names"""
    def __init__(self, topics: list[str] | None = ...) -> None: ...

class DeleteParam:
    """Deletes a parameter; does nothing if there is none."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[DeleteParamRequest]]
    _response_class: _ClassVar[type[DeleteParamResponse]]

class GetActionServers:
    """Lists the actions that have all five topics."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[GetActionServersRequest]]
    _response_class: _ClassVar[type[GetActionServersResponse]]

class GetParam:
    """Returns a parameter as JSON text."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[GetParamRequest]]
    _response_class: _ClassVar[type[GetParamResponse]]

class GetParamNames:
    """Lists the names of all parameters."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[GetParamNamesRequest]]
    _response_class: _ClassVar[type[GetParamNamesResponse]]

class GetTime:
    """Returns the present time of the node, which may be simulated."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[GetTimeRequest]]
    _response_class: _ClassVar[type[GetTimeResponse]]

class HasParam:
    """Tells whether a parameter exists."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[HasParamRequest]]
    _response_class: _ClassVar[type[HasParamResponse]]

class MessageDetails:
    """Describes a message type and all types in it."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[MessageDetailsRequest]]
    _response_class: _ClassVar[type[MessageDetailsResponse]]

class NodeDetails:
    """Lists the topics and services of a node."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[NodeDetailsRequest]]
    _response_class: _ClassVar[type[NodeDetailsResponse]]

class Nodes:
    """Lists the nodes of the system."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[NodesRequest]]
    _response_class: _ClassVar[type[NodesResponse]]

class Publishers:
    """Lists the nodes that publish a topic."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[PublishersRequest]]
    _response_class: _ClassVar[type[PublishersResponse]]

class SearchParam:
    """Searches the namespaces of the node for a parameter, innermost first."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[SearchParamRequest]]
    _response_class: _ClassVar[type[SearchParamResponse]]

class ServiceHost:
    """Returns the host that offers a service."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[ServiceHostRequest]]
    _response_class: _ClassVar[type[ServiceHostResponse]]

class ServiceNode:
    """Returns the node that offers a service."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[ServiceNodeRequest]]
    _response_class: _ClassVar[type[ServiceNodeResponse]]

class ServiceProviders:
    """Lists the nodes that offer services of a type."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[ServiceProvidersRequest]]
    _response_class: _ClassVar[type[ServiceProvidersResponse]]

class ServiceRequestDetails:
    """Describes the request of a service type and all types in it."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[ServiceRequestDetailsRequest]]
    _response_class: _ClassVar[type[ServiceRequestDetailsResponse]]

class ServiceResponseDetails:
    """Describes the response of a service type and all types in it."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[ServiceResponseDetailsRequest]]
    _response_class: _ClassVar[type[ServiceResponseDetailsResponse]]

class ServiceType:
    """Returns the type of a service."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[ServiceTypeRequest]]
    _response_class: _ClassVar[type[ServiceTypeResponse]]

class Services:
    """Lists the services of the system."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[ServicesRequest]]
    _response_class: _ClassVar[type[ServicesResponse]]

class ServicesForType:
    """Lists the services of a type."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[ServicesForTypeRequest]]
    _response_class: _ClassVar[type[ServicesForTypeResponse]]

class SetParam:
    """Sets a parameter."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[SetParamRequest]]
    _response_class: _ClassVar[type[SetParamResponse]]

class Subscribers:
    """Lists the nodes that receive a topic."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[SubscribersRequest]]
    _response_class: _ClassVar[type[SubscribersResponse]]

class TopicType:
    """Returns the type of a topic."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[TopicTypeRequest]]
    _response_class: _ClassVar[type[TopicTypeResponse]]

class Topics:
    """Lists the topics of the system with their types."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[TopicsRequest]]
    _response_class: _ClassVar[type[TopicsResponse]]

class TopicsAndRawTypes:
    """Lists the topics of the system with their types and definitions."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[TopicsAndRawTypesRequest]]
    _response_class: _ClassVar[type[TopicsAndRawTypesResponse]]

class TopicsForType:
    """Lists the topics of a type."""
    _type: _ClassVar[str]
    _md5sum: _ClassVar[str]
    _request_class: _ClassVar[type[TopicsForTypeRequest]]
    _response_class: _ClassVar[type[TopicsForTypeResponse]]
