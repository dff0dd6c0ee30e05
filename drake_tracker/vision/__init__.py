"""From images to points."""
