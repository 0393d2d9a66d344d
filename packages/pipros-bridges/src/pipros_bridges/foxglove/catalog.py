"""Channels and services that are advertised to Foxglove clients, with their ids. Performs no I/O."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

from pipros_tools.graph.definitions import Definition, ServiceDefinition


@dataclass(frozen=True, slots=True)
class Channel:
    """A topic and its type. If the type changes, the topic gets a new channel. IDs are never reused."""

    id: int
    topic: str
    definition: Definition

    @property
    def name(self) -> str:
        return self.topic


@dataclass(frozen=True, slots=True)
class Service:
    id: int
    name: str
    definition: ServiceDefinition


class Offer(Protocol):
    """A channel or a service."""

    @property
    def id(self) -> int: ...

    @property
    def name(self) -> str: ...

    @property
    def definition(self) -> object: ...


AnyOffer = TypeVar("AnyOffer", bound=Offer)
AnyDefinition = TypeVar("AnyDefinition")


@dataclass(frozen=True, slots=True)
class CatalogChange(Generic[AnyOffer]):
    """Added channels or services, and the ids of removed channels or services, for the clients."""

    added: Sequence[AnyOffer]
    removed: Sequence[int]


class TopicCatalog:
    """The channels and services that are currently offered, keyed by id."""

    def __init__(self) -> None:
        self.channels: dict[int, Channel] = {}
        self.services: dict[int, Service] = {}
        self._ids = itertools.count(1)

    def update_channels(self, found: Mapping[str, Definition]) -> CatalogChange[Channel]:
        """Offer these topics and no others. Return the changes."""
        return self._update(self.channels, found, Channel)

    def update_services(self, found: Mapping[str, ServiceDefinition]) -> CatalogChange[Service]:
        """Offer these services and no others. Return the changes."""
        return self._update(self.services, found, Service)

    def _update(
        self,
        offers: dict[int, AnyOffer],
        found: Mapping[str, AnyDefinition],
        make: Callable[[int, str, AnyDefinition], AnyOffer],
    ) -> CatalogChange[AnyOffer]:
        removed = [number for number, each in offers.items() if found.get(each.name) != each.definition]
        for number in removed:
            del offers[number]
        kept = {each.name for each in offers.values()}
        added = [
            make(next(self._ids), name, definition) for name, definition in found.items() if name not in kept
        ]
        offers.update((each.id, each) for each in added)
        return CatalogChange(added, removed)
