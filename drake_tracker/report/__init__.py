"""The page of a finished run, and the small server that shows it."""
