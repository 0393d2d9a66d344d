"""interactive_markers, as Noetic has it, on pipros: markers that people move and click in a viewer."""
