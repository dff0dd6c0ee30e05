"""Figure 14 of Allen et al. 1991: intercepting, grasping and picking up the object, in three frames."""

from typing import NamedTuple

import cv2

from drake_tracker.figures.paper_style import sheet
from drake_tracker.figures.studio import sample
from drake_tracker.grasp.schema import Phase
from drake_tracker.tasks.episode import phase_spans

SHOWN = ("intercept", "grasp", "lift")
WIDTH = 640
"""Width and height of a frame [px]."""
_CAPTIONS = {"track": "Tracking", "intercept": "Intercepting", "grasp": "Grasping", "lift": "Picking up"}


class Moment(NamedTuple):
    """An instant worth a picture: its name, simulated time [s], and the phase of the hand."""

    name: str
    time: float
    phase: str


def moments(log, scenario):
    """Returns a tuple of `Moment`: "track", "intercept", "grasp", "lift" of the last train that was lifted.

    Of a run without a lift it returns three instants of its second half, named after what the hand then did.
    """
    spans = phase_spans(log, scenario.time_step)
    lifts = [span for span in spans if span.phase == Phase.LIFT]
    if not lifts:
        end = spans[-1].end
        times = [share * end for share in (0.5, 0.75, 1.0)]
        return tuple(Moment(phase, time, phase) for time in times for phase in [_phase_at(spans, time)])
    (lift,) = lifts[-1:]
    reach = [span for span in spans if span.phase == Phase.INTERCEPT and span.start < lift.start][-1]
    times = {
        "track": reach.start - 0.1,
        # Most of the way down, the jaws still open.
        "intercept": reach.start + 0.8 * (reach.end - reach.start),
        "grasp": lift.start,
        "lift": lift.end,
    }
    return tuple(Moment(name, time, _phase_at(spans, time)) for name, time in times.items())


def _phase_at(spans, time):
    inside = [span.phase for span in spans if span.start <= time]
    return (inside[-1] if inside else spans[0].phase).name.lower()


def render_frames(studio, log, times, width=WIDTH):
    """Returns a BGR image, ``width`` px square, of the train and the hand at each of ``times`` [s]."""
    frames = []
    for time in times:
        studio.pose(log, time)
        x, y = sample(log["truth_train_state"], time)[4:6]
        frames.append(studio.render((x + 0.62, y - 0.98, 0.88), (x, y, 0.60), width, width, 26.0))
    return frames


def shown_moments(log, scenario):
    """Returns the three `Moment` of figure 14."""
    found = moments(log, scenario)
    named = tuple(moment for moment in found if moment.name in SHOWN)
    return named if len(named) == len(SHOWN) else found[-len(SHOWN) :]


def draw_grasp_frames(frames, shown):
    """Returns figure 14: BGR ``frames`` of the `Moment` in ``shown``, from left to right."""
    with sheet(13.2, 4.75) as figure:
        for axes, frame, moment in zip(figure.subplots(1, len(frames)), frames, shown, strict=True):
            axes.imshow(cv2.cvtColor(frame, cv2.COLOR_BGR2RGB), interpolation="lanczos")
            axes.set(xticks=[], yticks=[])
            axes.spines[:].set_visible(False)
            caption = _CAPTIONS.get(moment.name, moment.name.capitalize())
            after = moment.time - shown[0].time
            axes.set_title(f"{caption}, {after:.2f} s later" if after > 0.0 else f"Figure 14 · {caption}")
    return figure
