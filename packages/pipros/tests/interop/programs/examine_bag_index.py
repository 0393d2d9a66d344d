"""Print as JSON the results of a bag's private methods: examine_bag_index.py FILE MODE."""

import json
import sys

import rosbag
import rospy


def place(entry):
    return None if entry is None else [str(entry), entry.time.to_nsec(), list(entry.position)]


def told(message):
    return [message.topic, str(message.message), message.timestamp.to_nsec(), *map(sorted, message[3:])]


bag = rosbag.Bag(sys.argv[1], sys.argv[2])
if sys.argv[2] == "a":
    # read_messages flushes in genuine rosbag, too; its index lacks the messages of an open chunk
    list(bag.read_messages())
connections = sorted(bag._get_connections(), key=lambda each: each.id)
entries = list(bag._get_entries())
found = {
    "connections": [[each.id, each.topic, each.datatype, each.md5sum, each.msg_def] for each in connections],
    "texts": [str(each) == "%d on %s: %s" % (each.id, each.topic, each.header) for each in connections],
    "of topics": [
        [c.id for c in bag._get_connections(topics)] for topics in ("/a", ["//b/"], [], None, "/no")
    ],
    "filtered": [
        c.id for c in bag._get_connections(connection_filter=lambda t, d, m, f, h: d.endswith("String"))
    ],
    "by id": sorted(bag._connections),
    "topics": [bag._connections[key].topic for key in sorted(bag._connections)],
    "chunks": [
        [c.pos, c.start_time.to_nsec(), c.end_time.to_nsec(), sorted(c.connection_counts.items())]
        for c in bag._chunks
    ],
    "headers": [
        [at, h.compression, h.compressed_size, h.uncompressed_size, h.data_pos]
        for at, h in sorted(bag._chunk_headers.items())
    ],
    "sizes": [bag._has_compressed_chunks, bag._uncompressed_size, bag.size, bag._version, bag._mode],
    "entries": sorted(map(place, entries)),
    "is in order": [entry.time.to_nsec() for entry in entries],
    "reverse": [entry.time.to_nsec() for entry in bag._get_entries_reverse()],
    "indexes": sorted([place(entry) for entry in index] for index in bag._get_indexes(None)),
    "of a": [place(entry) for index in bag._get_indexes(bag._get_connections("/a")) for entry in index],
    "by connection": {
        key: [place(entry) for entry in index] for key, index in bag._connection_indexes.items()
    },
    "first": min(index[0].time.to_nsec() for index in bag._connection_indexes.values()),
    "filename": bag._filename == bag._file.name,
}
for number, (start, end) in enumerate([(10, 11), (10.0, None), (None, 11.0000015), (12.5, 12.9), (20, 21)]):
    times = [None if time is None else rospy.Time.from_sec(time) for time in (start, end)]
    for way in (bag._get_entries, bag._get_entries_reverse):
        got = way(bag._get_connections(["/a", "/b"]), *times)
        found["%s %s" % (way.__name__, number)] = [entry.time.to_nsec() for entry in got]
for secs in (9, 10, 10.0000005, 11, 13, 99):
    time = rospy.Time.from_sec(secs)
    for topics in (None, "/a"):
        chosen = None if topics is None else list(bag._get_connections(topics))
        found["at %s %s" % (secs, topics)] = [
            place(bag._get_entry(time, chosen)),
            place(bag._get_entry_after(time, chosen)),
        ]
entries.sort(key=lambda entry: entry.position)
found["messages"] = [told(bag._read_message(entry.position)) for entry in reversed(entries)]
found["with headers"] = told(bag._read_message(entries[3].position, return_connection_header=True))
raw = bag._read_message(entries[3].position, raw=True).message
found["raw"] = [raw[0], list(raw[1]), raw[2], list(raw[3]), raw[4]._type]
print(json.dumps(found, sort_keys=True))
