"""Trouble on the way from the cameras to the arm: vision, host and link."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from drake_tracker.arm.safety.packet_guard import REASONS, Rejection
from drake_tracker.core.messages import TrackPoints
from drake_tracker.tasks.episode import Log, PhaseSpan
from drake_tracker.tasks.tracks import fresh_tracks
from drake_tracker.tasks.train.diagnosis.trouble import Cause, Trouble, stretches, troubles
from drake_tracker.tasks.train.episode import sighted, train_pose
from drake_tracker.tasks.train.setup import TrainSetup
from drake_tracker.vision.silhouettes.target import REASONS as NO_POINT
from drake_tracker.vision.silhouettes.target import Reason

MOVING = 0.03
"""Speed of the train [m/s] from which vision should see it."""
UNSEEN = 0.3
"""Time without a centroid of the moving train [s] that counts as trouble; in normal runs there is none."""
OFF = 0.012
"""Error of a measured point [m] that does not occur in normal runs for a second."""
SHAKY = 0.006
"""Median change of the error from one point to the next [m] that does not occur in normal runs."""
CONSTANT = 0.7
"""Errors whose mean vector is longer than this fraction of their mean length have one direction in W."""
LASTING = 0.8
"""Share of the time from the first such error to the last in which a wrong calibration causes them. A temporary
disturbance, such as a shadow, causes errors for a smaller share."""
HOST_LATE, LINK_LATE = 0.2, 0.12
"""Ages [s] of the host's packet relative to vision's newest point, and of the arm's relative to the host's, that do not
occur in normal runs."""
SILENT = 0.2
"""Shortest stretch with late packets that counts as trouble [s]."""
LEARNING = 6.0
"""Time with valid points [s] after which every estimator predicts."""
FAR, FAR_FOR = 0.030, 0.15
"""Error of a measured point [m] that does not occur in normal runs, and its shortest duration that counts [s]."""
GAP = 0.008
"""Distance between the rays of the cameras [m] that only a camera in another place or direction keeps up. A second
object, or a shadow, is mostly seen by both cameras in the same place."""
_WINDOW = 1.0
_MILLIMETRES = "{:.0f} mm"
_FOLLOWED = f"vision followed something {_MILLIMETRES} from the train"


def vision_troubles(setup: TrainSetup, log: Log, spans: Sequence[PhaseSpan], until: float) -> list[Trouble]:
    """Returns where vision did not see the moving train, or saw it in the wrong place.

    Args:
        setup: the resolved scenario of the run.
        log: {name: Signal} of the run.
        spans: phases of the run.
        until: time until which points are judged [s].
    """
    if setup.several:
        return [*_without_point(log, spans, until), *_wrong_places(log, spans, until)]
    names = {"centroid_left": "the left camera", "centroid_right": "the right camera"}
    unseen = {name: _unseen(log, name, spans, until) for name in names if name in log} or {
        "point": _unseen(log, "point", spans, until)
    }
    blind = [
        Trouble(Cause.CAMERA, start, end, f"{names.get(name, 'vision')} did not see the moving train")
        for name, spells in unseen.items()
        for start, end in spells
    ]
    return [*blind, *_wrong_places(log, spans, until)]


def _without_point(log: Log, spans: Sequence[PhaseSpan], until: float) -> list[Trouble]:
    """Returns where a vision of several objects had no point of the moving target, with its most frequent reason."""
    messages = fresh_tracks(log)
    stamps, numbers = (messages[:, TrackPoints.get_fields().index(name)] for name in ("stamp", "reason"))
    found = []
    for start, end in _unseen(log, "point", spans, until):
        here = (stamps >= start) & (stamps <= end) & (numbers != Reason.NONE)
        reasons = Counter(numbers[here]).most_common(1)
        why = f", because {NO_POINT[Reason(int(reasons[0][0]))]}," if reasons else ""
        found.append(Trouble(Cause.CAMERA, start, end, f"vision had no point of the moving train{why}"))
    return found


def _unseen(log: Log, name: str, spans: Sequence[PhaseSpan], until: float) -> list[tuple[float, float]]:
    """Returns the stretches in which a signal of vision shows nothing although the train moves on its track."""
    signal = log[name]
    stamps = signal["stamp"]
    pose = train_pose(log, stamps)
    truth, verdict = log["truth_train_state"], log["truth_verdict"]
    speed = np.interp(stamps, truth.times, np.hypot(truth["vx"], truth["vy"]))
    raised = np.interp(stamps, verdict.times, np.abs(verdict["lift"])) > 0.01
    judged = (stamps > 0.0) & (stamps <= until) & sighted(spans, stamps) & np.isfinite(pose[:, 0])
    return stretches(stamps, judged & (speed > MOVING) & ~raised & (signal["valid"] == 0), UNSEEN)


def _wrong_places(log: Log, spans: Sequence[PhaseSpan], until: float) -> list[Trouble]:
    """Returns where the measured points were off the train, one `Trouble` for all stretches of one cause."""
    point = log["point"]
    stamps = point["stamp"]
    judged = (point["valid"] > 0) & (stamps > 0.0) & (stamps <= until) & sighted(spans, stamps)
    stamps, gaps = stamps[judged], point["gap"][judged]
    error = point.view("x", "y")[judged] - train_pose(log, stamps)[:, :2]
    known = np.isfinite(error).all(axis=1)
    stamps, gaps, error = stamps[known], gaps[known], error[known]
    windows, apart = [], {}
    for start in np.arange(stamps[0], stamps[-1], _WINDOW) if len(stamps) else ():
        inside = (stamps >= start) & (stamps < start + _WINDOW)
        if np.count_nonzero(inside) < 10:
            continue
        change = np.median(np.hypot(*np.diff(error[inside], axis=0).T))
        windows.append((start, np.median(error[inside], axis=0), change))
        apart[start] = np.percentile(gaps[inside], 10.0) > GAP
    shaky = [start for start, _, change in windows if change > SHAKY]
    off = [(start, mean) for start, mean, change in windows if change <= SHAKY and np.hypot(*mean) > OFF]
    found = []
    if shaky:
        found.append(
            Trouble(Cause.IMAGE_DISTURBED, shaky[0], shaky[-1] + _WINDOW, "the measured points jumped to and fro")
        )
    if off:
        vectors = np.array([mean for _, mean in off])
        lengths = np.hypot(*vectors.T)
        meanwhile = sum(off[0][0] <= start <= off[-1][0] for start, _, _ in windows)
        lasting = len(off) >= 3 and len(off) >= LASTING * meanwhile
        constant = np.hypot(*vectors.mean(axis=0)) > CONSTANT * lengths.mean()
        constant &= lasting or all(apart[start] for start, _ in off)
        cause = Cause.CALIBRATION if constant else Cause.SECOND_OBJECT
        what = f"the measured points lay {_MILLIMETRES} from the train in one direction" if constant else _FOLLOWED
        clause = what.format(1e3 * np.median(lengths))
        return [*found, Trouble(cause, float(off[0][0]), float(off[-1][0] + _WINDOW), clause)]
    distances = np.hypot(*error.T)
    for start, end in stretches(stamps, distances > FAR, FAR_FOR):
        clause = _FOLLOWED.format(1e3 * np.median(distances[(stamps >= start) & (stamps <= end)]))
        found.append(Trouble(Cause.SECOND_OBJECT, start, end, clause))
    return found


def rejected_packets(log: Log, until: float) -> list[Trouble]:
    """Returns where the arm kept rejecting packets of the host. Late packets are trouble with the link.

    Args:
        log: {name: Signal} of the run; that of an earlier version has no ``packet_report``.
        until: time until which packets are judged [s].
    """
    report = log.get("packet_report")
    if report is None or len(report.times) == 0:
        return []
    times = report.times[1:]
    here = (np.diff(report["rejected"]) > 0) & (report["reason"][1:] != Rejection.PAST) & (times <= until)
    spells = stretches(times, here, SILENT)
    found = []
    for start, end in spells:
        reasons = report["reason"][1:][here & (times >= start) & (times <= end)]
        words = " and ".join(REASONS[Rejection(int(reason))] for reason in dict.fromkeys(reasons))
        found.append(Trouble(Cause.HOST, start, end, f"the arm rejected packets: {words}"))
    return found


def host_troubles(log: Log, until: float) -> list[Trouble]:
    """Returns where the host made no prediction from valid points.

    Args:
        log: {name: Signal} of the run.
        until: time until which the host is judged [s].
    """
    point, prediction = log["point"], log["prediction"]
    count = min(len(point.times), len(prediction.times))
    times, sees = point.times[:count], point["valid"][:count] > 0
    predicted = prediction["valid"][:count] > 0
    behind = sees & (point["stamp"][:count] - prediction["stamp"][:count] > HOST_LATE)
    judged = times <= until
    found = troubles(Cause.HOST, "the host made no prediction", times, judged & predicted & behind, SILENT)
    if not predicted[judged].any():
        found += troubles(Cause.HOST, "the host never made a prediction", times, judged & sees, LEARNING, bridge=0.5)
    return found


def link_troubles(log: Log, until: float) -> list[Trouble]:
    """Returns where the arm had older packets than the host, or none.

    Args:
        log: {name: Signal} of the run.
        until: time until which the link is judged [s].
    """
    prediction, delivered = log["prediction"], log["delivered"]
    count = min(len(prediction.times), len(delivered.times))
    times, sent = prediction.times[:count], prediction["valid"][:count] > 0
    arrived = delivered["valid"][:count] > 0
    age = prediction["stamp"][:count] - delivered["stamp"][:count]
    late = (times <= until) & sent & (~arrived | (age > LINK_LATE))
    spells = stretches(times, late, SILENT, bridge=0.5)
    return [Trouble(Cause.LINK, start, end, _late(times, age, arrived, start, end)) for start, end in spells]


def _late(times: np.ndarray, age: np.ndarray, arrived: np.ndarray, start: float, end: float) -> str:
    here = (times >= start) & (times <= end)
    if not arrived[here].any():
        return "no packet of the host reached the arm"
    return f"the arm's packets were up to {age[here & arrived].max():.1f} s older than the host's"
