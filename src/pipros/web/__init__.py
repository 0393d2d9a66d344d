"""The web page behind `rqt_graph` and the other rqt commands, and its server."""
