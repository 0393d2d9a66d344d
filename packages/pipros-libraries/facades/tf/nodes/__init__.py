"""Executables of the tf package."""
