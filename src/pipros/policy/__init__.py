"""Policies: what clients of servers may publish, call and set. Reads policy files and decides about acts."""
