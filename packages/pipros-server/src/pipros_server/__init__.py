"""Code shared by the servers for browsers and other clients: secrets, origins, ports, TLS, nodes' pages."""
