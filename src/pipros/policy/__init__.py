"""Policies, which define what a server's clients may do. Reads policy files, and decides about acts."""
