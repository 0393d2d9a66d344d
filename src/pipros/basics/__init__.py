"""Values in, values out: names, limits, errors, files, and text of peers. No sockets, no threads."""
