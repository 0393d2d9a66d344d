"""Drop-in replacement for Noetic's bondpy: bonds, with which two processes detect each other's exit."""
