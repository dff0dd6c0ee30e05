import numpy as np
import pytest

from drake_tracker.core import messages
from drake_tracker.core.messages import (
    EXPECTED_FIELDS,
    KNOT_COUNT,
    KNOT_FIELDS,
    KNOT_SPACING,
    PREDICTION_HEADER,
    REGION_FIELDS,
    REGION_SLOTS,
    TRACK_FIELDS,
    TRACK_SLOTS,
    Prediction,
    Regions,
    TrackPoints,
    TrackPredictions,
    evaluate_prediction,
    message_rows,
    message_size,
    pack_prediction,
    prediction_knots,
)

VIEWS = [view for view in vars(messages).values() if hasattr(view, "get_fields")]
STAMP = 2.5


def knots_of(function):
    """Knots (KNOT_COUNT, 5) of a function of the time [s] after the stamp."""
    return np.array([function(k * KNOT_SPACING) for k in range(KNOT_COUNT)])


def line(t):
    return np.array([0.4 + 0.1 * t, -0.2 * t, 0.485, 3.0 + 2.0 * t, 0.001 * t])


def test_the_module_holds_exactly_these_messages():
    assert {view.__name__ for view in VIEWS} == {
        *("FrameInfo", "Centroid", "TrackPoint", "Filtered", "Prediction", "ServoTarget", "ArmCommand", "ToolStatus"),
        *("Regions", "TrackPoints", "TrackPredictions"),
        *("PacketReport", "LimiterReport", "HandPoint", "HandCorrection", "WristPoint"),
        *("JawState", "GraspDiagnosis", "OperatorCommand", "CatchDiagnosis", "TouchReport", "Verdict", "CatchVerdict"),
        *("PartTracks", "BeltEstimate", "EncoderReading", "EncoderReport", "PickOrder", "PickDiagnosis", "PickVerdict"),
    }


@pytest.mark.parametrize("view", VIEWS, ids=lambda view: view.__name__)
def test_field_names_are_unique_and_all_zeros_is_not_valid(view):
    fields = view.get_fields()
    assert len(set(fields)) == len(fields) == message_size(view)
    if "valid" in fields:
        assert not view(np.zeros(message_size(view))).valid


def test_a_packet_spans_one_and_a_half_seconds():
    assert pytest.approx(1.5) == (KNOT_COUNT - 1) * KNOT_SPACING
    assert message_size(Prediction) == PREDICTION_HEADER + KNOT_COUNT * len(KNOT_FIELDS)
    assert tuple(Prediction.get_fields()[:PREDICTION_HEADER]) == ("stamp", "seq", "first_time", "spacing", "valid")


def test_a_packed_prediction_keeps_all_values():
    knots = np.random.default_rng(0).normal(size=(KNOT_COUNT, len(KNOT_FIELDS)))
    packet = pack_prediction(STAMP, 7, knots)
    assert packet.shape == (message_size(Prediction),)
    view = Prediction(packet)
    assert (view.stamp, view.seq, view.first_time, view.spacing, view.valid) == (STAMP, 7, STAMP, KNOT_SPACING, 1.0)
    assert np.array_equal(prediction_knots(packet), knots)
    # The names of the fields agree with the layout of the knots.
    assert view.x0 == knots[0, 0] and view.yaw3 == knots[3, 3]
    assert getattr(view, f"std{KNOT_COUNT - 1}") == knots[-1, -1]


@pytest.mark.parametrize("after", [0.0, 0.02, 0.05, 0.7499, 1.49, 1.5])
def test_a_straight_path_is_exact_between_knots(after):
    packet = pack_prediction(STAMP, 1, knots_of(line))
    assert evaluate_prediction(packet, STAMP + after) == pytest.approx(line(after), abs=1e-12)


@pytest.mark.parametrize("after", [-0.3, 1.51, 2.5])
def test_the_path_is_extrapolated_linearly_beyond_its_ends(after):
    packet = pack_prediction(STAMP, 1, knots_of(line))
    assert evaluate_prediction(packet, STAMP + after) == pytest.approx(line(after), abs=1e-12)


def test_a_curved_path_is_exact_at_its_knots_and_lies_on_the_chord_between_them():
    def bend(t):
        return np.array([np.cos(t), np.sin(t), 0.0, t, 0.0])

    packet = pack_prediction(STAMP, 1, knots_of(bend))
    for k in (0, 1, 17, KNOT_COUNT - 1):
        assert evaluate_prediction(packet, STAMP + k * KNOT_SPACING) == pytest.approx(bend(k * KNOT_SPACING), abs=1e-12)
    middle = evaluate_prediction(packet, STAMP + 4.5 * KNOT_SPACING)
    assert middle == pytest.approx(0.5 * (bend(4 * KNOT_SPACING) + bend(5 * KNOT_SPACING)), abs=1e-12)
    sagitta = 1.0 - np.hypot(*middle[:2])
    assert sagitta == pytest.approx(KNOT_SPACING**2 / 8, rel=1e-2)


def test_the_spacing_of_the_packet_is_used():
    knots = np.array([line(0.02 * k) for k in range(KNOT_COUNT)])
    packet = pack_prediction(STAMP, 1, knots, spacing=0.02)
    assert evaluate_prediction(packet, STAMP + 0.33) == pytest.approx(line(0.33), abs=1e-12)


SLOTTED = [
    (Regions, REGION_FIELDS, REGION_SLOTS),
    (TrackPoints, TRACK_FIELDS, TRACK_SLOTS),
    (TrackPredictions, EXPECTED_FIELDS, TRACK_SLOTS),
]


@pytest.mark.parametrize(("view", "fields", "slots"), SLOTTED, ids=lambda value: getattr(value, "__name__", ""))
def test_the_slots_of_a_message_are_its_numbered_fields(view, fields, slots):
    message = np.arange(message_size(view), dtype=float)
    rows = message_rows(message, fields)
    assert rows.shape == (slots, len(fields))
    named = view(message)
    for slot in range(slots):
        assert [getattr(named, f"{field}{slot}") for field in fields] == rows[slot].tolist()


@pytest.mark.parametrize(("view", "fields", "slots"), SLOTTED, ids=lambda value: getattr(value, "__name__", ""))
def test_what_is_written_to_the_slots_is_in_the_message(view, fields, slots):
    message = np.zeros(message_size(view))
    message_rows(message, fields)[slots - 1, 0] = 7.0
    assert getattr(view(message), f"{fields[0]}{slots - 1}") == 7.0
    assert np.count_nonzero(message) == 1


@pytest.mark.parametrize(("view", "fields", "slots"), SLOTTED, ids=lambda value: getattr(value, "__name__", ""))
def test_the_header_of_a_slotted_message_has_no_numbered_field(view, fields, slots):
    header = view.get_fields()[: message_size(view) - slots * len(fields)]
    assert header and not any(name[-1].isdigit() for name in header)
