"""Bags on the page: opened, played, drawn as tracks, exported, recorded."""
