"""The line from host to arm."""
