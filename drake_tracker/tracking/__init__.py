"""Tracks what moves before the user's own cameras."""
