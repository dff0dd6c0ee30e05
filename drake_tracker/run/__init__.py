"""Runs a scenario: simulation, recorders, and the host process."""
