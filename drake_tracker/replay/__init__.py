"""Replays of recorded runs: vision, estimator, link and servo run again on recorded images, centroids or points.

A run directory goes in (`open_recording`), with changed settings if desired; out comes a dict with the errors of run
and replay against ground truth, and whether their signals are bit-identical (`replay_run`). The world is not simulated.

    run directory ──▶ LogSourceSystem, VideoSource ──▶ vision, host, link and servo of the run ──▶ log ──▶ Judge
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
