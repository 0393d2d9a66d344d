"""`metadata.yaml`, which describes the files and topics of a ROS 2 bag.

Up to version 8, QoS profiles are YAML text in which policies are numbers; in version 9 they are a list in
which policies are names. Humble and Iron cannot read version 9 (ros2/rosbag2#2013).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import yaml

from pipros.safe.yaml import YamlError, load
from pipros_rosbag2.distribution import Distribution
from pipros_tools.bag.errors import BagFormatError

Profiles = Sequence[Mapping[str, Any]]
"""QoS profiles. Policies are words or, as in older bags, numbers."""

_POLICIES = {
    "history": ("system_default", "keep_last", "keep_all", "unknown"),
    "reliability": ("system_default", "reliable", "best_effort", "unknown", "best_available"),
    "durability": ("system_default", "transient_local", "volatile", "unknown", "best_available"),
    "liveliness": (
        "system_default",
        "automatic",
        "manual_by_node",
        "manual_by_topic",
        "unknown",
        "best_available",
    ),
}
"""The words of policies, in the order of their numbers in `rmw/types.h`."""

QOS_FIELD = "offered_qos_profiles"
"""The field of ROS 1 connection headers that keeps the QoS profiles of a topic of ROS 2."""

_INFINITE = {"sec": 9223372036, "nsec": 854775807}
_WORDS_SINCE = 9
_TYPE_HASHES_SINCE = 7
_DISTRIBUTION_SINCE = 6


@dataclass(frozen=True, slots=True)
class TopicMetadata:
    """A topic in a bag.

    Attributes:
        qos: the profiles of the publishers, with numbers or words.
        type_hash: the type hash, or empty.
    """

    name: str
    type: str
    qos: Profiles = ()
    type_hash: str = ""
    count: int = 0
    encoding: str = "cdr"


@dataclass(frozen=True, slots=True)
class BagMetadata:
    """The content of `metadata.yaml`.

    Attributes:
        start_ns, duration_ns: time of the first message, and the time from the first to the last message.
        distribution: the distribution that wrote the bag, or None if it is unknown.
        compression: the format in which files or messages are compressed, or empty.
        custom_data: keys and values that the recorder was given.
    """

    version: int
    storage: str
    files: Sequence[str]
    topics: Sequence[TopicMetadata]
    start_ns: int = 0
    duration_ns: int = 0
    count: int = 0
    distribution: Distribution | None = None
    compression: str = ""
    custom_data: Mapping[str, str] = field(default_factory=dict)


def latched_profiles(*, is_latched: bool) -> Profiles:
    """Return the profiles of a topic of ROS 1: one if it is latched, otherwise none."""
    words = {"reliability": "reliable", "durability": "transient_local"}
    rest = {"deadline": dict(_INFINITE), "lifespan": dict(_INFINITE), "liveliness": "automatic"}
    lease = {"liveliness_lease_duration": dict(_INFINITE), "avoid_ros_namespace_conventions": False}
    return [{"history": "keep_last", "depth": 1, **words, **rest, **lease}] if is_latched else []


def parsed_profiles(profiles: Any) -> Profiles:
    """Return profiles from text or values; malformed ones are left out."""
    if isinstance(profiles, str):
        try:
            profiles = load(profiles, "offered_qos_profiles", angles=False)
        except YamlError:
            return ()
    return [each for each in profiles if isinstance(each, dict)] if isinstance(profiles, list) else ()


def qos_profiles(profiles: Profiles, version: int) -> Any:
    """Return the value of `offered_qos_profiles`: text, or since version 9 a list with words."""
    has_words = version >= _WORDS_SINCE
    found = [_converted(each, has_words) for each in profiles]
    return found if has_words else _text(found)


def qos_text(profiles: Profiles, version: int) -> str:
    """Return profiles as YAML text, as in MCAP and SQLite files. The text is empty if there are none."""
    return _text([_converted(each, version >= _WORDS_SINCE) for each in profiles])


def _text(profiles: Profiles) -> str:
    return yaml.safe_dump(list(profiles), sort_keys=False) if profiles else ""


def _converted(profile: Mapping[str, Any], has_words: bool) -> dict[str, Any]:
    """Return a profile with words or numbers. Values without a counterpart stay as they are."""
    found = dict(profile)
    for name in found.keys() & _POLICIES.keys():
        words = _POLICIES[name]
        value = found[name]
        if has_words and isinstance(value, int) and 0 <= value < len(words):
            found[name] = words[value]
        elif not has_words and value in words:
            found[name] = words.index(value)
    return found


def is_latched(profiles: Any) -> bool:
    """Return whether any of the profiles, given as text or values, has the durability transient_local."""
    return any(each.get("durability") in (1, "transient_local") for each in parsed_profiles(profiles))


def metadata_text(metadata: BagMetadata) -> str:
    """Return the content of `metadata.yaml`."""
    return yaml.safe_dump({"rosbag2_bagfile_information": _values(metadata)}, sort_keys=False)


def metadata_record(metadata: BagMetadata) -> str:
    """Return the copy of the metadata to be stored in an MCAP or SQLite file."""
    return yaml.safe_dump(_values(metadata), sort_keys=False)


def _values(metadata: BagMetadata) -> dict[str, Any]:
    version = metadata.version
    start = {"nanoseconds_since_epoch": metadata.start_ns}
    duration = {"nanoseconds": metadata.duration_ns}
    topics = []
    for topic in metadata.topics:
        described: dict[str, Any] = {
            "name": topic.name,
            "type": topic.type,
            "serialization_format": topic.encoding,
            "offered_qos_profiles": qos_profiles(topic.qos, version),
        }
        if version >= _TYPE_HASHES_SINCE:
            described["type_description_hash"] = topic.type_hash
        topics.append({"topic_metadata": described, "message_count": topic.count})
    files = [
        {
            "path": name,
            "starting_time": dict(start),
            "duration": dict(duration),
            "message_count": metadata.count,
        }
        for name in metadata.files
    ]
    values: dict[str, Any] = {
        "version": version,
        "storage_identifier": metadata.storage,
        "duration": duration,
        "starting_time": start,
        "message_count": metadata.count,
        "topics_with_message_count": topics,
        "compression_format": "",
        "compression_mode": "",
        "relative_file_paths": list(metadata.files),
        "files": files,
    }
    if version >= _DISTRIBUTION_SINCE:
        values["custom_data"] = dict(metadata.custom_data) or None
        values["ros_distro"] = metadata.distribution.value if metadata.distribution else ""
    return values


def parse_metadata(text: str, where: str) -> BagMetadata:
    """Parse `metadata.yaml`.

    Raises:
        BagFormatError: the file is malformed.
    """
    try:
        document = load(text, where, angles=False)
    except YamlError as error:
        raise BagFormatError(str(error)) from None
    try:
        values = document["rosbag2_bagfile_information"]
        topics = tuple(_topic(each) for each in values["topics_with_message_count"])
        files = tuple(str(name) for name in values["relative_file_paths"])
        return BagMetadata(
            int(values["version"]),
            str(values["storage_identifier"]),
            files,
            topics,
            int(values["starting_time"]["nanoseconds_since_epoch"]),
            int(values["duration"]["nanoseconds"]),
            int(values["message_count"]),
            _distribution(values.get("ros_distro")),
            str(values.get("compression_format") or ""),
            {str(key): str(value) for key, value in dict(values.get("custom_data") or {}).items()},
        )
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise BagFormatError(f"{where}: a value is missing or has the wrong type: {error}") from None


def _topic(values: Mapping[str, Any]) -> TopicMetadata:
    topic = values["topic_metadata"]
    return TopicMetadata(
        str(topic["name"]),
        str(topic["type"]),
        parsed_profiles(topic.get("offered_qos_profiles")),
        str(topic.get("type_description_hash") or ""),
        int(values["message_count"]),
        str(topic["serialization_format"]),
    )


def _distribution(name: Any) -> Distribution | None:
    return next((each for each in Distribution if each.value == name), None)
