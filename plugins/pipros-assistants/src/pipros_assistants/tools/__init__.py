"""Classes whose public methods are the tools. Clients see the docstrings and signatures of these methods."""
