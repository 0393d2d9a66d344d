"""The tests of pipros, and their shared code (`tests.support`)."""
