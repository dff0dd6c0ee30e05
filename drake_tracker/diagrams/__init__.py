"""The wiring of a hand-eye system."""
