"""Channels and services that are advertised to Foxglove clients, with their ids. Performs no I/O."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Generic, Protocol, TypeVar


@dataclass(frozen=True, slots=True)
class Definition:
    """A topic type.

    Attributes:
        text: the definition, followed by the definitions of all embedded types.
    """

    type: str
    md5sum: str
    text: str = field(repr=False)


@dataclass(frozen=True, slots=True)
class ServiceDefinition:
    """A service type. The definitions have the same form as `Definition.text`."""

    type: str
    md5sum: str
    request_text: str = field(repr=False)
    response_text: str = field(repr=False)


@dataclass(frozen=True, slots=True)
class Channel:
    """A topic and its type. If the type changes, the topic gets a new channel. IDs are never reused."""

    id: int
    topic: str
    definition: Definition


@dataclass(frozen=True, slots=True)
class Service:
    id: int
    name: str
    definition: ServiceDefinition


class Offer(Protocol):
    """A channel or a service."""

    @property
    def id(self) -> int: ...


AnyOffer = TypeVar("AnyOffer", bound=Offer)


@dataclass(frozen=True, slots=True)
class Change(Generic[AnyOffer]):
    """Added channels or services, and the ids of removed ones, to announce to the clients."""

    added: Sequence[AnyOffer]
    removed: Sequence[int]


class Catalog:
    """The channels and services that are currently offered, keyed by id."""

    def __init__(self) -> None:
        self.channels: dict[int, Channel] = {}
        self.services: dict[int, Service] = {}
        self._ids = itertools.count(1)

    def update_channels(self, found: Mapping[str, Definition]) -> Change[Channel]:
        """Offer these topics and no others. Return the changes."""
        kept = {channel.topic: channel.id for channel in self.channels.values()}
        removed = [
            number for number, each in self.channels.items() if found.get(each.topic) != each.definition
        ]
        for number in removed:
            del kept[self.channels.pop(number).topic]
        added = [
            Channel(next(self._ids), topic, definition)
            for topic, definition in found.items()
            if topic not in kept
        ]
        self.channels.update((each.id, each) for each in added)
        return Change(added, removed)

    def update_services(self, found: Mapping[str, ServiceDefinition]) -> Change[Service]:
        """Offer these services and no others. Return the changes."""
        kept = {service.name: service.id for service in self.services.values()}
        removed = [
            number for number, each in self.services.items() if found.get(each.name) != each.definition
        ]
        for number in removed:
            del kept[self.services.pop(number).name]
        added = [
            Service(next(self._ids), name, definition)
            for name, definition in found.items()
            if name not in kept
        ]
        self.services.update((each.id, each) for each in added)
        return Change(added, removed)
