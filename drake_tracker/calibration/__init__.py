"""Calibrates cameras, and measures the error of the vision."""
