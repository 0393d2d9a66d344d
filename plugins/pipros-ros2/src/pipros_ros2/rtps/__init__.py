"""A participant of RTPS 2.3, the wire protocol of DDS, limited to what ROS 2 uses.

The following modules use neither sockets nor a clock. In order, from bytes to samples:

    submessages, encoding, parameters   bytes to values, and back
    announcements, qos                  announcements of participants and endpoints, and which endpoints match
    writer, history, reader_proxy       the sending end of a reliable or best-effort connection
    reader, incomplete, writer_proxy    the receiving end
    outbox                              the datagrams of both
    peers, connections, presence        other participants, matched endpoints, our own announcements
    participant_core                    combines all of these, still without sockets

`participant` adds sockets and threads; `topics`, `services` and `nodes` are its thread-safe interface, which
`engine` adapts to the gateway. XTypes, security, TCP, keyed topics and partitions are left out: ROS 2
needs none of them for topics and services.

Alternatives: the Cyclone DDS wheel lacks related sample identities, so it can neither serve nor call Fast DDS
services, and there is no wheel for Linux on ARM. dust-dds cannot pass on serialized data.
"""
