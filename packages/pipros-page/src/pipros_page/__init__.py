"""The web page that `rqt_graph` and the other rqt commands open, and its server."""
