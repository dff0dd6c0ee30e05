"""Tests of what the summary says about the tracking of several objects, on made-up logs."""

from dataclasses import replace

import numpy as np
import pytest
from track_messages import regions, track, track_points, tracks_signal

from drake_tracker.commands.report import report
from drake_tracker.core.log import Signal
from drake_tracker.core.messages import REGION_FIELDS, Regions, message_rows
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.grasp.train.schema import Phase
from drake_tracker.report.failure_diagnosis import perform
from drake_tracker.tasks.episode import PhaseSpan
from drake_tracker.tasks.train.diagnosis.cause import main_trouble
from drake_tracker.tasks.train.diagnosis.trouble import Cause
from drake_tracker.tasks.train.diagnosis.trouble_tracking import tell_tracking, tracking_findings
from drake_tracker.tasks.train.episode import phase_spans
from drake_tracker.tasks.train.setup import resolve
from drake_tracker.tasks.train.summary import summarise
from drake_tracker.vision.camera_motion import Verdict
from drake_tracker.vision.silhouettes.config import SilhouetteTracker
from drake_tracker.vision.silhouettes.target import REASONS, Reason

CYCLES = 360
SPANS = (PhaseSpan(Phase.ACQUIRE, 0.0, 1.0), PhaseSpan(Phase.TRACK, 1.0, 6.0))


def cycle(time):
    return round(time / VISION_PERIOD)


def made_up_log(tracks=lambda k: {}, views=None, cycles=CYCLES, first=1):
    """A log of cycles ``first`` and following. ``tracks(k)``: arguments of `track_points`, two tracks by default.

    ``views(k, side)``: dict of the header's fields, ``shared`` for the region of track 1; None: measured vision.
    """

    def message(k):
        given = {"tracks": (track(1), track(2)), "target": 1} | tracks(k)
        return track_points((k + first) * VISION_PERIOD, **given)

    log = {"tracks": tracks_signal(message, cycles)}
    for side in ("left", "right") if views is not None else ():
        rows = []
        for k in range(cycles):
            vector = regions((k + first) * VISION_PERIOD, (100, 100, 40, 20, 1), (200, 100, 40, 20, 2))
            header, fields = Regions(vector), dict(views(k, side))
            message_rows(vector, REGION_FIELDS)[0, REGION_FIELDS.index("shared")] = fields.pop("shared", 0.0)
            for name, value in fields.items():
                setattr(header, name, value)
            rows.append(vector)
        times = VISION_PERIOD * np.arange(cycles)
        log[f"regions_{side}"] = Signal(times, np.array(rows), tuple(Regions.get_fields()))
    return log


def camera(verdict, displacement=0.0):
    return {
        "camera": list(Verdict).index(verdict),
        "displacement": displacement,
        "usable": float(verdict is not Verdict.UNUSABLE),
    }


def nothing(k, side):
    return {}


def test_a_run_without_trouble_says_nothing():
    found = tracking_findings(made_up_log(views=nothing), SPANS)
    assert tell_tracking(found) == []
    assert found["most_tracks"] == 2 and found["cameras"] == {} and found["without_point"] is None
    assert (found["overflow"], found["target_changes"], found["unusable_pairs"], found["merged_s"]) == (0, 0, 0, 0.0)


def test_measured_vision_has_no_images():
    found = tracking_findings(made_up_log(), SPANS)
    assert found["merged_s"] is None and found["unusable_pairs"] is None and tell_tracking(found) == []


def test_an_empty_log():
    found = tracking_findings({}, ())
    assert found["most_tracks"] == 0 and tell_tracking(found) == []


def test_more_objects_than_slots():
    found = tracking_findings(made_up_log(lambda k: {"overflow": 3 if k == 40 else 0}), SPANS)
    assert found["overflow"] == 3
    (sentence,) = tell_tracking(found)
    assert sentence.startswith("Up to 3 regions or tracks found no slot")


def test_a_target_that_is_lost_and_replaced():
    def tracks(k):
        if k < 120:
            return {}
        return {"target": 0, "reason": Reason.NO_MATCH} if k < 150 else {"target": 2}

    found = tracking_findings(made_up_log(tracks), SPANS)
    assert found["target_changes"] == 1
    assert found["first_target_change"] == {"time_s": pytest.approx(151 * VISION_PERIOD), "before": 1, "after": 2}
    assert "The target changed once at 2.5 s, from object 1 to object 2." in tell_tracking(found)


def test_the_longest_time_without_a_point():
    def tracks(k):
        if k < 30:
            return {"target": 0, "reason": Reason.NO_OBJECT}  # before the first point: nobody has seen it yet
        if 90 <= k < 100:
            return {"reason": Reason.NOT_OBSERVED}
        if 200 <= k < 260:
            return {"reason": Reason.OCCLUDED if k < 245 else Reason.OUT_OF_VIEW}
        return {}

    found = tracking_findings(made_up_log(tracks), SPANS)
    assert found["longest_without_point_s"] == pytest.approx(1.0)
    assert found["without_point"]["reasons"] == {"OCCLUDED": 0.75, "OUT_OF_VIEW": 0.25}
    (sentence,) = tell_tracking(found)
    assert sentence == (
        "There was no point of the target from 3.4 to 4.3 s: the arm covers the target (75%); "
        "the target is outside of an image (25%)."
    )
    blind = (*SPANS[:1], PhaseSpan(Phase.TRACK, 1.0, 3.0), PhaseSpan(Phase.CLOSE, 3.0, 6.0))
    assert tracking_findings(made_up_log(tracks), blind)["longest_without_point_s"] == pytest.approx(10 / 60)


def test_a_target_that_was_never_seen():
    found = tracking_findings(made_up_log(lambda k: {"target": 0, "reason": Reason.NO_MATCH}), SPANS)
    assert found["longest_without_point_s"] == pytest.approx(6.0, abs=0.05)
    assert REASONS[Reason.NO_MATCH] in tell_tracking(found)[0]


def test_a_merged_silhouette_of_the_target():
    log = made_up_log(views=lambda k, side: {"shared": float(side == "right" and (k < 90 or 200 <= k < 206))})
    found = tracking_findings(log, SPANS)
    assert found["merged_s"] == pytest.approx(1.6) and found["longest_merged_s"] == pytest.approx(1.5)
    assert tell_tracking(found) == [
        "The silhouette of the target was merged with that of another object for 1.6 s, 1.5 s of them in a row."
    ]
    other = made_up_log(lambda k: {"target": 2}, lambda k, side: {"shared": 1.0})
    assert tracking_findings(other, SPANS)["merged_s"] == 0.0, "the target's own silhouette is not merged"


def test_unusable_images():
    def views(k, side):
        if 60 <= k < 72:
            return {"usable": 0.0}
        if 100 <= k < 106:
            return camera(Verdict.UNUSABLE) if side == "left" else {"usable": 0.0}
        return camera(Verdict.UNUSABLE) if 200 <= k < 230 else {}

    found = tracking_findings(made_up_log(views=views), SPANS)
    assert found["unusable_pairs"] == 48 and found["longest_unusable_s"] == pytest.approx(0.5)
    assert found["unusable_for"] == {"light": 12, "left": 6, "both": 30}
    (sentence,) = tell_tracking(found)
    assert sentence.startswith("48 pairs of images could not be used, for at most 0.5 s in a row: the light changed;")
    assert "the left image could not" in sentence and "the right image" not in sentence


def test_a_camera_that_was_knocked_is_to_be_calibrated_again():
    def views(k, side):
        if side == "right" or k < cycle(3.0):
            return {}
        return camera(Verdict.COMPENSATED if k < cycle(4.0) else Verdict.DISPLACED, 6.2)

    found = tracking_findings(made_up_log(views=views), SPANS)
    assert set(found["cameras"]) == {"left"}
    left = found["cameras"]["left"]
    assert left["knocked_at_s"] == pytest.approx(3.0, abs=0.02) and left["displacement_px"] == 6.2
    assert tell_tracking(found) == [
        "The left camera was displaced by 6 px at 3.0 s and stayed so: calibrate it again before you trust its points."
    ]


def test_a_camera_that_shakes_is_not_out_of_calibration():
    def views(k, side):
        return camera(Verdict.COMPENSATED, 3.0) if side == "right" and 60 <= k < 90 else {}

    found = tracking_findings(made_up_log(views=views), SPANS)
    right = found["cameras"]["right"]
    assert right["knocked_at_s"] is None and right["stays_displaced"] is False
    assert tell_tracking(found) == [
        "The right camera moved by up to 3 px, first at 1.0 s and for 0.5 s in all; its images were aligned."
    ]


def test_a_camera_that_came_back():
    def views(k, side):
        return camera(Verdict.DISPLACED, 5.0) if side == "left" and 60 <= k < 120 else {}

    (sentence,) = tell_tracking(tracking_findings(made_up_log(views=views), SPANS))
    assert sentence.startswith("The left camera was displaced by 5 px at 1.0 s for some time")


@pytest.fixture
def dark_run(episode):
    """A scenario with several objects, and the log of a run in which the light goes out at 3 s."""
    episode.valid = lambda t: (t < 3.0).astype(float)
    scenario = episode.scenario.with_settings({"vision.method": SilhouetteTracker()})
    log = episode.log()
    stamps = log["point"]["stamp"]
    first = int(np.argmax(stamps > 0.0))
    dark = lambda k: {"reason": Reason.UNUSABLE_IMAGE} if (k + 1) * VISION_PERIOD >= 3.0 else {}  # noqa: E731
    usable = lambda k, side: {"usable": float((k + 1) * VISION_PERIOD < 3.0)}  # noqa: E731
    for name, signal in made_up_log(dark, usable, cycles=len(stamps) - first).items():
        log[name] = replace(signal, times=log["point"].times[first:])
    return scenario, log


def test_the_summary_tells_the_troubles(dark_run):
    scenario, log = dark_run
    summary = summarise(resolve(scenario), log, 6.0)
    assert summary["tracking"]["unusable_for"].keys() == {"light"}
    assert any("could not be used" in sentence for sentence in summary["tracking"]["sentences"])


def test_a_failure_in_the_dark_is_told_with_its_reason(dark_run):
    scenario, log = dark_run
    trouble = main_trouble(resolve(scenario), log, phase_spans(log))
    assert trouble is not None and trouble.cause is Cause.CAMERA
    assert f"because {REASONS[Reason.UNUSABLE_IMAGE]}" in trouble.sentence
    verdict = perform(scenario, log)["verdict"]
    assert "pairs of images could not be used" in verdict and "  " not in verdict


def test_the_command_prints_a_line_for_each_trouble(dark_run, tmp_path, capsys):
    scenario, log = dark_run
    summary = summarise(resolve(scenario), log, 6.0)
    report(scenario, summary, tmp_path)
    lines = capsys.readouterr().out.splitlines()
    told = [f"{'tracking':<18}{sentence}" for sentence in summary["tracking"]["sentences"]]
    assert told and [line for line in lines if line.startswith("tracking")] == told
