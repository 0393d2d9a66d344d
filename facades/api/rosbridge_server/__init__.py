"""The programs of rosbridge_server: servers of the rosbridge protocol for WebSockets, TCP and UDP."""
