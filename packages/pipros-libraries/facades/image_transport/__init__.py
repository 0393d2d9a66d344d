"""Executables of the image_transport package: `republish` and `list_transports`."""
