"""Figure 14 of Allen et al. 1991: intercepting, grasping and picking up the object, in three frames."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import cv2
import numpy as np
from matplotlib.figure import Figure

from drake_tracker.core.log import Signal
from drake_tracker.figures.paper_style import sheet
from drake_tracker.figures.studio import Studio, sample
from drake_tracker.grasp.train.schema import Phase
from drake_tracker.scenarios.base import BaseScenario
from drake_tracker.tasks.episode import PhaseSpan
from drake_tracker.tasks.train.episode import phase_spans

SHOWN = ("intercept", "grasp", "lift")
WIDTH = 640
"""Width and height of a frame [px]."""
_CAPTIONS = {"track": "Tracking", "intercept": "Intercepting", "grasp": "Grasping", "lift": "Picking up"}


class Moment(NamedTuple):
    """An instant that is shown in a picture.

    Attributes:
        name: of the instant.
        time: simulated time [s].
        phase: name of the phase of the hand.
    """

    name: str
    time: float
    phase: str


def moments(log: Mapping[str, Signal], scenario: BaseScenario) -> tuple[Moment, ...]:
    """Returns the `Moment`s "track", "intercept", "grasp" and "lift" of the last lift.

    For a run without a lift it returns three instants of its second half, named after the phase of the hand.

    Args:
        log: {name: Signal}.
        scenario: of the run.
    """
    spans = phase_spans(log, scenario.time_step)
    lifts = [span for span in spans if span.phase == Phase.LIFT]
    if not lifts:
        end = spans[-1].end
        times = [share * end for share in (0.5, 0.75, 1.0)]
        return tuple(Moment(phase, time, phase) for time in times for phase in [_phase_at(spans, time)])
    (lift,) = lifts[-1:]
    reach = [span for span in spans if span.phase == Phase.INTERCEPT and span.start < lift.start][-1]
    instants = {
        "track": reach.start - 0.1,
        # Most of the way down, the jaws still open.
        "intercept": reach.start + 0.8 * (reach.end - reach.start),
        "grasp": lift.start,
        "lift": lift.end,
    }
    return tuple(Moment(name, time, _phase_at(spans, time)) for name, time in instants.items())


def _phase_at(spans: Sequence[PhaseSpan], time: float) -> str:
    inside = [span.phase for span in spans if span.start <= time]
    return (inside[-1] if inside else spans[0].phase).name.lower()


def render_frames(
    studio: Studio, log: Mapping[str, Signal], times: Sequence[float], width: int = WIDTH
) -> list[np.ndarray]:
    """Returns a square BGR image of the train and the hand for each time.

    Args:
        studio: of the run's scenario.
        log: {name: Signal}.
        times: simulated times [s].
        width: width and height of an image [px].
    """
    frames = []
    for time in times:
        studio.pose(log, time)
        x, y = sample(log["truth_train_state"], time)[4:6]
        frames.append(studio.render((x + 0.62, y - 0.98, 0.88), (x, y, 0.60), width, width, 26.0))
    return frames


def shown_moments(log: Mapping[str, Signal], scenario: BaseScenario) -> tuple[Moment, ...]:
    """Returns the three `Moment`s of figure 14.

    Args:
        log: {name: Signal}.
        scenario: of the run.
    """
    found = moments(log, scenario)
    named = tuple(moment for moment in found if moment.name in SHOWN)
    return named if len(named) == len(SHOWN) else found[-len(SHOWN) :]


def draw_grasp_frames(frames: Sequence[np.ndarray], shown: Sequence[Moment]) -> Figure:
    """Returns figure 14.

    Args:
        frames: BGR images, from left to right.
        shown: the `Moment` of each frame.
    """
    with sheet(13.2, 4.75) as figure:
        for axes, frame, moment in zip(figure.subplots(1, len(frames)), frames, shown, strict=True):
            axes.imshow(cv2.cvtColor(frame, cv2.COLOR_BGR2RGB), interpolation="lanczos")
            axes.set(xticks=[], yticks=[])
            axes.spines[:].set_visible(False)
            caption = _CAPTIONS.get(moment.name, moment.name.capitalize())
            after = moment.time - shown[0].time
            axes.set_title(f"{caption}, {after:.2f} s later" if after > 0.0 else f"Figure 14 · {caption}")
    return figure
