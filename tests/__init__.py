"""The tests of pipros, and what they share (`tests.support`)."""
