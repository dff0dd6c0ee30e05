"""How often the page of the live view is brought up to date."""

from drake_tracker.core.processes.worker_pool import processors

SPARE = processors() > 2
"""Whether this machine has a processor for the browser in addition to the processors that simulate and render."""
FRAME_INTERVAL = 1 / 12 if SPARE else 1 / 6
"""Wall time [s] between two camera frames while a page is open."""
EVENTS_INTERVAL = 1 / 20 if SPARE else 1 / 8
"""Shortest wall time [s] between two events."""
