"""From packets to joint commands."""
