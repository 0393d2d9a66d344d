"""A server's interactive markers and their pending changes. Uses neither topics nor a clock."""
