"""How far what vision reports of the parts is from the truth, according to the log of a run."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from drake_tracker.core.messages import PART_FIELDS, PART_SLOTS
from drake_tracker.core.part_kinds import PART_SHAPES, PartKind
from drake_tracker.tasks.conveyor.part_history import tracks_of
from drake_tracker.tasks.episode import Log
from drake_tracker.world.conveyor.arrivals import Arrival
from drake_tracker.world.conveyor.part_fates import PartFate

UNCLEAR_STD = 0.1
"""A part that is reported with a larger standard deviation lies there, but is not measured [m]."""
_NUMBER, _KIND, _X, _Y, _YAW, _VAR, _SEEN = (
    PART_FIELDS.index(name) for name in ("number", "kind", "x", "y", "yaw", "var_along", "seen")
)


class PartMeasurements(NamedTuple):
    """Measurements of parts that lie on the belt.

    Attributes:
        track: number under which vision reports the part, shape (n,).
        part: number of the true part, from 0, shape (n,).
        right_kind: whether the kind is right, shape (n,).
        error: of x, y [m] and direction [rad], NaN for a part without one, shape (n, 3).
        y: true place along the belt [m], shape (n,).
    """

    track: np.ndarray
    part: np.ndarray
    right_kind: np.ndarray
    error: np.ndarray
    y: np.ndarray


def measurements(log: Log, arrivals: Sequence[Arrival]) -> PartMeasurements:
    """Returns all measurements in a log, those of parts that the arm has already lifted left out.

    Args:
        log: {name: Signal} of the run.
        arrivals: the parts of the run.
    """
    parts, states, fates = log["parts"], log["truth_part_states"], log["truth_fates"]
    owner = {number: k for k, numbers in enumerate(tracks_of(log, len(arrivals))) for number in numbers}
    found = []
    last = 0.0
    for header, data in zip(parts.data[:, :2], parts.data[:, 2:]):
        if not header[1] or header[0] <= last:
            continue
        last = header[0]
        then = min(int(np.searchsorted(states.times, last - 1e-6)), len(states.times) - 1)
        rows = data.reshape(PART_SLOTS, len(PART_FIELDS))
        for row in rows[(rows[:, _NUMBER] > 0) & (rows[:, _SEEN] >= last) & (rows[:, _VAR] < UNCLEAR_STD**2)]:
            k = owner[int(row[_NUMBER])]
            if fates.data[then, k] not in (PartFate.UPSTREAM, PartFate.ON_BELT):
                continue
            qw, qx, qy, qz, x, y = states.data[then, 13 * k : 13 * k + 6]
            yaw = np.arctan2(2.0 * (qx * qy + qw * qz), qw**2 + qx**2 - qy**2 - qz**2)
            turns = PART_SHAPES[arrivals[k].kind].turns
            turn = np.nan
            if turns:
                period = 2.0 * np.pi / turns
                turn = (row[_YAW] - yaw + 0.5 * period) % period - 0.5 * period
            right = row[_KIND] == arrivals[k].kind
            found.append((row[_NUMBER], k, right, row[_X] - x, row[_Y] - y, turn, y))
    table = np.array(found, dtype=float).reshape(-1, 7)
    return PartMeasurements(
        table[:, 0].astype(int), table[:, 1].astype(int), table[:, 2] > 0, table[:, 3:6], table[:, 6]
    )


def vision_errors(log: Log, arrivals: Sequence[Arrival], kind: PartKind | None = None) -> dict[str, float | int | None]:
    """Returns the errors of the vision of a run. Parts that lie on a side are left out.

    - ``measurements``, ``parts``: numbers of measurements, and of parts that were measured.
    - ``bias_m``, ``turn_bias_rad``: root mean square over the parts of the mean error of a part, per axis.
    - ``noise_m``, ``turn_noise_rad``: root mean square of what is left of the errors.
    - ``largest_m``: largest distance of a measurement from the truth.
    - ``wrong_kind``: measurements with a wrong kind.
    - ``identities_lost``: number of further numbers that parts had after their first one.
    - ``first_seen_y_m``: median place along the belt at which a part was first measured.

    Args:
        log: {name: Signal} of the run.
        arrivals: the parts of the run.
        kind: of the parts that count; None: all.
    """
    found = measurements(log, arrivals)
    wanted = np.array([not each.lies and kind in (None, each.kind) for each in arrivals])
    found = PartMeasurements(*(values[wanted[found.part]] for values in found))
    if not len(found.part):
        return {"measurements": 0, "parts": 0}
    seen = np.unique(found.part)
    means = np.array([found.error[found.part == k].mean(axis=0) for k in seen])
    noise = found.error - means[np.searchsorted(seen, found.part)]
    first = [found.y[found.part == k][0] for k in seen]
    numbers = [len(np.unique(found.track[found.part == k])) for k in seen]
    return {
        "measurements": len(found.part),
        "parts": len(seen),
        "bias_m": _rms(means[:, :2]),
        "turn_bias_rad": _rms(means[:, 2]),
        "noise_m": _rms(noise[:, :2]),
        "turn_noise_rad": _rms(noise[:, 2]),
        "largest_m": float(np.linalg.norm(found.error[:, :2], axis=1).max()),
        "wrong_kind": int((~found.right_kind).sum()),
        "identities_lost": sum(numbers) - len(numbers),
        "first_seen_y_m": float(np.median(first)),
    }


def _rms(values: np.ndarray) -> float | None:
    values = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(values**2))) if len(values) else None
