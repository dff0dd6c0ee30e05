"""Tests of the summary of a run of the conveyor, on a made-up run."""

import numpy as np
import pytest
from conveyor_log import ConveyorRun, Story, nothing_logged

from drake_tracker.core.messages import PickVerdict, message_size
from drake_tracker.core.part_kinds import PartKind
from drake_tracker.tasks.conveyor.figures import draw_conveyor, rate_per_minute
from drake_tracker.tasks.conveyor.setup import resolve
from drake_tracker.tasks.conveyor.summary import summarise_conveyor
from drake_tracker.tasks.conveyor.task import TASK
from drake_tracker.tasks.conveyor.windows import could_be_picked, window_times
from drake_tracker.world.conveyor.belt_motion import make_belt_motion


def summarise(run, **changes):
    return summarise_conveyor(resolve(run.scenario), run.arrivals, run.log(), run.duration, **changes)


def placed(time, cell=0, kind=PartKind.BOX, **changes):
    return Story(time, kind, picked=time + 3.0, placed=time + 5.0, cell=cell, **changes)


def test_a_run_in_which_all_parts_are_placed():
    run = ConveyorRun([placed(1.0, 0), placed(4.0, 1, PartKind.DISC), placed(8.0, 2, PartKind.ELL)])
    summary = summarise(run)
    assert summary["success"] is True and summary["failure_reason"] is None
    assert (summary["arrived"], summary["picked"], summary["placed"], summary["missed"]) == (3, 3, 3, 0)
    assert summary["could_be_picked"] == summary["placed_of_these"] == 3
    assert summary["picks_per_minute"] == pytest.approx(3 * 60.0 / run.duration)
    assert summary["missed_because"] == {} and summary["misplaced"] == 0
    assert summary["placement_rms_m"] == pytest.approx(0.0, abs=1e-6)
    assert TASK.success_sentence(summary).startswith("3 of the 3 parts")


def test_where_and_how_parts_lie_is_measured_from_the_middles_of_their_cells():
    run = ConveyorRun([placed(1.0, 0, offset=(0.003, 0.0)), placed(4.0, 1, PartKind.ELL, offset=(0.0, -0.001))])
    summary = summarise(run)
    assert summary["placement_rms_m"] == pytest.approx(np.sqrt((0.003**2 + 0.001**2) / 2), abs=1e-6)
    assert summary["placement_turn_rms_rad"] == 0.0


@pytest.mark.parametrize(
    "kind, turn, error",
    [
        (PartKind.BOX, 0.1, 0.1),
        (PartKind.BOX, np.pi + 0.1, 0.1),
        (PartKind.ELL, 0.1, 0.1),
        (PartKind.ELL, np.pi, np.pi),
        (PartKind.DISC, 1.0, None),
    ],
)
def test_the_direction_counts_modulo_the_symmetry_of_the_kind(kind, turn, error):
    summary = summarise(ConveyorRun([placed(1.0, 0, kind, turn=turn)]))
    if error is None:
        assert summary["placement_turn_rms_rad"] is None and summary["misplaced"] == 0
    else:
        assert summary["placement_turn_rms_rad"] == pytest.approx(error, abs=1e-6)
        assert summary["misplaced"] == (error > np.deg2rad(10.0))


def test_a_part_that_reaches_out_of_its_cell_is_misplaced():
    inside, outside = placed(1.0, 0, offset=(0.0, 0.006)), placed(4.0, 1, offset=(0.0, 0.010))
    assert summarise(ConveyorRun([inside]))["misplaced"] == 0
    assert summarise(ConveyorRun([outside]))["misplaced"] == 1


@pytest.mark.parametrize(
    "changes, reason",
    [
        ({"attempted": True}, "grasp failed"),
        ({"seen": False}, "not seen in time"),
        ({"clear": 0.001, "ordered": False}, "no space for the jaws"),
        ({}, "out of reach"),
        ({"ordered": False}, "not chosen"),
    ],
)
def test_why_a_part_was_missed(changes, reason):
    run = ConveyorRun([Story(1.0, **changes), placed(4.0, 1)])
    summary = summarise(run)
    assert summary["missed_because"] == {reason: 1}
    assert summary["missed"] == 1 and not summary["success"]
    assert "1 of 2 parts that could be picked were placed" in summary["failure_reason"]
    assert reason in summary["failure_reason"]


def test_a_part_for_which_no_cell_was_left():
    stories = [placed(1.0 + 2.0 * k, k) for k in range(4)] + [Story(12.0, ordered=False)]
    settings = {"tray.columns": 1, "tray.rows": 2}
    assert summarise(ConveyorRun(stories, **settings))["missed_because"] == {"trays full": 1}


def test_a_part_that_arrives_too_late_does_not_count():
    run = ConveyorRun([placed(1.0, 0), Story(24.0, ordered=False)])
    summary = summarise(run)
    assert summary["success"] and summary["arrived"] == 2 and summary["could_be_picked"] == 1
    assert summary["missed_because"] == {"arrived too late": 1}


def test_a_part_that_is_being_picked_when_the_run_ends_is_not_a_failed_grasp():
    run = ConveyorRun([placed(1.0, 0), Story(28.3, attempted=True)])
    assert summarise(run)["missed_because"] == {"run ended": 1}


def test_what_could_be_picked_depends_on_the_end_of_the_run_alone():
    run = ConveyorRun([Story(1.0)])
    arrival = run.arrivals[0]
    enters, leaves = window_times(resolve(run.scenario), arrival, make_belt_motion(run.scenario.belt))
    speed, window = run.scenario.belt.speed, run.scenario.window
    assert enters == pytest.approx(arrival.time + (window.y_first - run.scenario.belt.entry) / speed, abs=0.02)
    assert leaves - enters == pytest.approx((window.y_last - window.y_first) / speed)
    assert not could_be_picked(resolve(run.scenario), arrival, leaves + 1.0)
    assert could_be_picked(resolve(run.scenario), arrival, leaves + 4.0)


def test_dropped_parts_are_counted_and_are_a_failure():
    summary = summarise(ConveyorRun([Story(1.0, picked=4.0, dropped=True), placed(4.0, 1)]))
    assert (summary["dropped"], summary["picked"], summary["placed"]) == (1, 2, 1)
    assert not summary["success"] and "1 dropped" in summary["failure_reason"]
    assert summary["missed_because"] == {}


def test_a_run_that_logged_nothing():
    run = ConveyorRun([Story(1.0)])
    summary = summarise_conveyor(
        resolve(run.scenario), run.arrivals, nothing_logged(run.arrivals), 0.0, interrupted=True
    )
    assert not summary["success"] and summary["failure_reason"].startswith("interrupted; until then no part had left")
    assert summary["picks_per_minute"] is None and summary["placement_rms_m"] is None


def test_reasons_are_in_the_order_of_their_frequency():
    run = ConveyorRun([Story(1.0, attempted=True), Story(2.0, ordered=False), Story(3.0, ordered=False)])
    assert list(summarise(run)["missed_because"].items()) == [("not chosen", 2), ("grasp failed", 1)]


def test_a_run_is_over_when_all_parts_have_been_dealt_with():
    def verdict(**fields):
        found = PickVerdict(np.zeros(message_size(PickVerdict)))
        for name, value in fields.items():
            setattr(found, name, value)
        return found

    assert TASK.ended(verdict()) is None
    assert TASK.ended(verdict(coming=1, arrived=2, placed=2)) is None
    assert TASK.ended(verdict(arrived=3, placed=2, held=3)) is None
    assert TASK.ended(verdict(arrived=3, placed=1, missed=1, dropped=1)) is not None


def test_rates_are_counts_over_the_last_interval():
    rate = rate_per_minute(np.array([1.0, 2.0, 21.5]), np.array([0.0, 2.0, 10.0, 20.9, 22.5]), 20.0)
    assert rate == pytest.approx([0.0, 60.0 * 2 / 5.0, 60.0 * 2 / 10.0, 60.0 * 2 / 20.0, 60.0 * 1 / 20.0])


def test_the_picture_is_drawn_of_any_run(tmp_path):
    run = ConveyorRun([placed(1.0), Story(3.0), Story(5.0, picked=8.0, dropped=True), Story(25.0)])
    draw_conveyor(resolve(run.scenario), run.arrivals, run.log(), summarise(run), tmp_path / "full.png")
    empty = nothing_logged(run.arrivals)
    summary = summarise_conveyor(resolve(run.scenario), run.arrivals, empty, 0.0, True)
    draw_conveyor(resolve(run.scenario), run.arrivals, empty, summary, tmp_path / "empty.png")
    assert (tmp_path / "full.png").stat().st_size > 50_000 and (tmp_path / "empty.png").is_file()
