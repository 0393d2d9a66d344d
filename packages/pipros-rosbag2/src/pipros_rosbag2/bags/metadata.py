"""`metadata.yaml`, which describes the files and topics of a ROS 2 bag.

Up to version 8, QoS profiles are YAML text in which policies are numbers; in version 9 they are a list in
which policies are names. Humble and Iron cannot read version 9 (ros2/rosbag2#2013).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import yaml

from pipros.bag.errors import BagFormatError
from pipros.ros2.distribution import Distribution
from pipros.safe.yaml import YamlError, load

_INFINITE = {"sec": 9223372036, "nsec": 854775807}
_WORDS_SINCE = 9
_TYPE_HASHES_SINCE = 7
_DISTRIBUTION_SINCE = 6


@dataclass(frozen=True, slots=True)
class TopicMetadata:
    """A topic in a bag.

    Attributes:
        is_latched: whether the publishers offer the durability transient_local.
        type_hash: the type hash, or empty.
    """

    name: str
    type: str
    is_latched: bool = False
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


def qos_profiles(*, is_latched: bool, version: int) -> Any:
    """Return the value of `offered_qos_profiles`, which is empty for topics that are not latched."""
    has_words = version >= _WORDS_SINCE
    profiles = []
    if is_latched:
        words = ("keep_last", "reliable", "transient_local", "automatic")
        history, reliability, durability, liveliness = words if has_words else (1, 1, 1, 1)
        profiles.append(
            {
                "history": history,
                "depth": 1,
                "reliability": reliability,
                "durability": durability,
                "deadline": dict(_INFINITE),
                "lifespan": dict(_INFINITE),
                "liveliness": liveliness,
                "liveliness_lease_duration": dict(_INFINITE),
                "avoid_ros_namespace_conventions": False,
            }
        )
    if has_words:
        return profiles
    return qos_text(profiles)


def qos_text(profiles: Sequence[Any]) -> str:
    """Return profiles as YAML text, as in MCAP and SQLite files. The text is empty if there are none."""
    return yaml.safe_dump(list(profiles), sort_keys=False) if profiles else ""


def is_latched(profiles: Any) -> bool:
    """Return whether any of the profiles, given as text or values, has the durability transient_local."""
    if isinstance(profiles, str):
        try:
            profiles = load(profiles, "offered_qos_profiles", angles=False)
        except YamlError:
            return False
    if not isinstance(profiles, list):
        return False
    return any(
        isinstance(each, dict) and each.get("durability") in (1, "transient_local") for each in profiles
    )


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
            "offered_qos_profiles": qos_profiles(is_latched=topic.is_latched, version=version),
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
        values["custom_data"] = None
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
        )
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise BagFormatError(f"{where}: a value is missing or has the wrong type: {error}") from None


def _topic(values: Mapping[str, Any]) -> TopicMetadata:
    topic = values["topic_metadata"]
    return TopicMetadata(
        str(topic["name"]),
        str(topic["type"]),
        is_latched(topic.get("offered_qos_profiles")),
        str(topic.get("type_description_hash") or ""),
        int(values["message_count"]),
        str(topic["serialization_format"]),
    )


def _distribution(name: Any) -> Distribution | None:
    return next((each for each in Distribution if each.value == name), None)
