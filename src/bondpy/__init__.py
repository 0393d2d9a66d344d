"""bondpy: bonds between two processes, by which each knows when the other one is gone."""
