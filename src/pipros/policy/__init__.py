"""Policies, which define what a server's clients may do: read them from files, and apply them to acts."""
