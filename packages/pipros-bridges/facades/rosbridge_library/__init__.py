"""Drop-in replacement for the parts of Noetic's rosbridge_library that other packages import."""
