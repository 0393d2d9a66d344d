"""Drawings of the graph: contents, layout, and output as DOT, SVG, PNG and PDF."""
