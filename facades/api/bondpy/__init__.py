"""Drop-in replacement for Noetic's bondpy: bonds, by which two processes detect each other's end."""
