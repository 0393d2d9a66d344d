"""The executables of the package image_transport, which convert images between transports."""
