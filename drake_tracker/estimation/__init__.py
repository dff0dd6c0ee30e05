"""Estimation, on the host computer: filters the measured points and predicts the path.

`TrackPoint` messages go in; packets of predicted path (`Prediction`) and the filtered state (`Filtered`) come out of
`EstimatorSystem`. The arithmetic is an `Estimator`, which `make_estimator` makes of its settings: `ClosedPath`,
`CoordinatedTurn`, `ArcLength`, `AlphaBetaGamma`, or `InclinedPlane` for a ball on a board. With several tracked objects
(`TrackPoints`), `EstimatorBankSystem` runs one estimator for each of them.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
