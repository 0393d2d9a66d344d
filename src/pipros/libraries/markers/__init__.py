"""A server's interactive markers and their pending changes, without topics or a clock."""
