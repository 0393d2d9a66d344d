"""The programs of the package tf."""
