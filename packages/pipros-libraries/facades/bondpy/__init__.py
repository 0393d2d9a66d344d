"""Drop-in replacement for Noetic's bondpy: bonds, which let two processes detect each other's exit."""
