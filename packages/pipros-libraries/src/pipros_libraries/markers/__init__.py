"""A server's interactive markers and their pending changes. This package uses neither topics nor a clock."""
