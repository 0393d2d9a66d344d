"""Policies: what clients of servers may publish, call and set. Files, decisions and their enforcement."""
