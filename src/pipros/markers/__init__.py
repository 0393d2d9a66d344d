"""Interactive markers: the markers of a server, and pending changes. No topics, no clock."""
