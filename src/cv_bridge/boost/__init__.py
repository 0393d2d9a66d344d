"""What genuine cv_bridge has in C++."""
