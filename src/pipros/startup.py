"""Runs at every start of a Python interpreter that has pipros installed (by `pipros.pth`)."""
