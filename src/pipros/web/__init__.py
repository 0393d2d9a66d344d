"""The pages of `rqt_graph` and its family, and the server that they come from."""
