"""Drawings of the graph: its contents, its layout, and its output as DOT, SVG, PNG and PDF. No sockets."""
