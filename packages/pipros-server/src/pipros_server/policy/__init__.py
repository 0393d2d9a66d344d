"""Read policies, which define what a server's clients may do, and apply them to the clients' acts."""
