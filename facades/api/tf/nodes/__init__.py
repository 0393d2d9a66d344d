"""Executables of the package tf."""
