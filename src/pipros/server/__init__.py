"""Code shared by all servers for clients: secrets, origins, ports, TLS, and the pages of single nodes."""
