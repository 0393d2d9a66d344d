"""The interactive markers of a server and their pending changes, without topics or a clock."""
