"""Drop-in replacement for Noetic's interactive_markers: markers that users move and click in a viewer."""
