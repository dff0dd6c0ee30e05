"""The simulated laboratory; the only package that knows the truth."""
