"""Calibrates cameras, and measures the error of the vision.

In go a scenario, or photographs of a chessboard. Out come files: calibrated cameras, which scenarios and tracking read,
and the measured error of the vision, from which runs without rendering are simulated.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
