"""What all servers for clients share: secrets, origins, ports, TLS, and the pages of single nodes."""
