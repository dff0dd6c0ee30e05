"""The network between the host's process and the arm's: LCM channels, messages, and Drake's Systems that carry them."""
