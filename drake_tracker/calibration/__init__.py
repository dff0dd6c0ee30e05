"""Calibrates cameras, and measures the error of the vision.

In go a scenario, or photographs of a chessboard. Out come files: calibrated cameras, which scenarios and tracking read,
and the measured error of the vision, from which runs without rendering are simulated. Begin with `photographs.py` for
real cameras, `rendered_boards.py` for simulated ones, `measure_vision.py` for the error.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
