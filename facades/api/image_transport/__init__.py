"""The executables of the package image_transport: `republish` and `list_transports`."""
