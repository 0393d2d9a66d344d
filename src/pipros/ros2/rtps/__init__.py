"""A participant of RTPS 2.3, the protocol of DDS, for the part of it that ROS 2 uses.

Modules without sockets and without a clock, from bytes to samples:

    submessages, parameters   bytes to values and back
    endpoints                 what participants announce about themselves, and quality of service
    history, proxies          the two ends of a reliable or best-effort connection
    discovery                 peers, with their leases and limits
    engine                    all of the above: datagrams in, datagrams and events out

`participant` adds sockets and threads. XTypes, security, TCP, keyed topics and partitions are left out: ROS 2
needs none of them for topics and services.

Compared with the alternatives: the wheel of Cyclone DDS has no related sample identity, so it cannot serve
or call services of Fast DDS, and lacks Linux on ARM; dust-dds cannot pass serialized data through.
"""
