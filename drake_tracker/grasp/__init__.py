"""What the hand does next."""
