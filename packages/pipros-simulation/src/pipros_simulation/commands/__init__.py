"""The command `pipros sim-for`, and the programs of controller_manager."""
