"""The graph as a drawing: what is in it, where it stands, and DOT, SVG and PNG of it. No sockets."""
