"""The language of CMake, as far as packages need it that compile nothing."""
