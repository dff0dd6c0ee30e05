"""Estimation, on the host computer: filters the measured points and predicts the path.

`TrackPoint` messages go in; packets of predicted path (`Prediction`) and the filtered state (`Filtered`) come out of
`EstimatorSystem`. Begin with `estimator.py`, the role and its registry: `make_estimator` makes an `Estimator` of its
settings, `ClosedPath`, `CoordinatedTurn`, `ArcLength`, `AlphaBetaGamma`, or `InclinedPlane` for a ball on a board. Each
kind is the module of its name, made of the filters in `parts`. With several tracked objects (`TrackPoints`),
`EstimatorBankSystem` runs one estimator for each of them.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
