"""Interactive markers: what a server shows, and the changes that wait. No topics, no clock."""
