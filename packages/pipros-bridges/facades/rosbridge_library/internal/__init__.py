"""Message conversion, class lookup and exceptions of rosbridge_library."""
