"""Names, limits, errors, files, and text received from peers."""
