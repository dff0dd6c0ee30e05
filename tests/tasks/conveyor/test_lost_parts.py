"""Why parts were lost, on made-up runs."""

import numpy as np
import pytest
from conveyor_log import ConveyorRun, Story

from drake_tracker.core.messages import BELT_FIELDS, PART_SLOTS, TARGET_STRIDE, message_rows
from drake_tracker.grasp.conveyor.pick_schema import PickPhase
from drake_tracker.tasks.conveyor.lost_parts import chances, lost_parts
from drake_tracker.tasks.conveyor.part_history import part_histories
from drake_tracker.tasks.conveyor.setup import resolve
from drake_tracker.tasks.conveyor.summary import summarise_conveyor
from drake_tracker.tasks.conveyor.windows import clairvoyant_picks, window_times
from drake_tracker.world.conveyor.belt_motion import make_belt_motion


def found(run, log):
    return lost_parts(
        resolve(run.scenario), part_histories(resolve(run.scenario), run.arrivals, log), log, run.duration
    )


def window_of(run, k=0):
    return window_times(resolve(run.scenario), run.arrivals[k], make_belt_motion(run.scenario.belt))


def test_every_lost_part_has_a_sentence_and_a_placed_one_has_none():
    run = ConveyorRun([Story(1.0, picked=4.0, placed=6.0), Story(3.0, picked=6.0, dropped=True), Story(26.0)])
    lost = found(run, run.log())
    assert [(part.number, part.cause) for part in lost] == [(2, "dropped"), (3, "arrived too late")]
    assert lost[0].sentence == "Part 2 (box), dropped: it was picked and did not reach a cell."


def test_a_part_that_is_held_at_the_end_is_not_missed():
    run = ConveyorRun([Story(1.0, picked=29.5), Story(2.0, picked=4.0, placed=6.0)])
    summary = summarise_conveyor(resolve(run.scenario), run.arrivals, run.log(), run.duration)
    assert summary["missed_because"] == {} and "run ended" in summary["lost_parts"]["sentences"][0]


@pytest.mark.parametrize("gap, cause", [(0.4, "not chosen"), (0.7, "identity lost")])
def test_a_part_that_the_host_loses_in_the_window(gap, cause):
    run = ConveyorRun([Story(1.0, ordered=False)])
    log = run.log()
    enters = window_of(run)[0]
    estimates = log["belt"].data[:, 4:].reshape(-1, PART_SLOTS, len(BELT_FIELDS))
    times = log["belt"].times
    estimates[(times > enters + 1.0) & (times < enters + 1.0 + gap)] = 0.0
    assert found(run, log)[0].cause == cause


def test_a_part_that_is_seen_only_behind_the_window():
    run = ConveyorRun([Story(1.0, ordered=False)])
    log = run.log()
    log["parts"].data[log["parts"].times < window_of(run)[1] + 0.1] = 0.0
    assert found(run, log)[0].cause == "not seen in time"


def busy(run, log, number):
    """Lets the hand carry from 0 s on, but for a moment in which it sets out for a part."""
    enters, leaves = window_of(run)
    log["command"].data[:, 0] = PickPhase.CARRY
    starts = int(np.searchsorted(log["command"].times, 0.5 * (enters + leaves)))
    log["command"].data[starts : starts + 5, 0] = PickPhase.TRACK
    for name in ("number", "valid"):
        column = log["order"].names.index(name)
        log["order"].data[:, column] = number
    return starts


def test_a_hand_that_picks_another_part_instead():
    run = ConveyorRun([Story(1.0, ordered=False), Story(2.0, picked=8.0, placed=10.0)])
    log = run.log()
    starts = busy(run, log, number=2)
    for row in log["belt"].data:
        for slot in message_rows(row, BELT_FIELDS):
            slot[BELT_FIELDS.index("x")], slot[BELT_FIELDS.index("speed")] = 0.6, 0.15
    log["status"].data[:, log["status"].names.index("x")] = 0.5
    (lost,) = found(run, log)
    assert lost.cause == "not chosen" and "part 2 was picked instead" in lost.sentence
    assert chances(resolve(run.scenario), log)[1].time == pytest.approx(log["command"].times[starts])


def test_a_hand_that_follows_a_part_without_descending():
    run = ConveyorRun([Story(1.0)])
    log = run.log()
    starts = busy(run, log, number=1)
    log["target"].data[starts : starts + 5, log["target"].names.index("seq")] = TARGET_STRIDE + 3
    assert found(run, log)[0].cause == "ordered too late"


def test_a_hand_that_is_never_free_in_time():
    run = ConveyorRun([Story(1.0, ordered=False), Story(2.0, picked=8.0, placed=10.0)])
    log = run.log()
    log["command"].data[:, 0] = PickPhase.CARRY
    (lost,) = found(run, log)
    assert lost.cause == "out of reach" and chances(resolve(run.scenario), log) == {}


def test_no_arm_picks_more_parts_than_arrive_or_fit_into_the_cells():
    stories = [Story(1.0 + 4.0 * k) for k in range(6)]
    run = ConveyorRun(stories)
    assert clairvoyant_picks(resolve(run.scenario), run.arrivals, 60.0) == 6
    assert clairvoyant_picks(resolve(run.scenario), run.arrivals, 0.5) == 0
    few = ConveyorRun(stories, **{"tray.columns": 1, "tray.rows": 1})
    assert clairvoyant_picks(resolve(few.scenario), few.arrivals, 60.0) == 2
    stopping = ConveyorRun(stories, **{"belt.motion": "stop_and_go"})
    assert clairvoyant_picks(resolve(stopping.scenario), stopping.arrivals, 60.0) is None


def test_a_part_that_lies_on_its_side_has_a_cause_of_its_own_and_could_not_be_picked():
    run = ConveyorRun([Story(1.0, picked=4.0, placed=6.0), Story(2.0, lies=True)])
    lost = found(run, run.log())
    assert [part.cause for part in lost] == ["lies on its side"] and "left it alone" in lost[0].sentence
    summary = summarise_conveyor(resolve(run.scenario), run.arrivals, run.log(), run.duration)
    assert summary["could_be_picked"] == 1 and summary["success"] and summary["share_of_clairvoyant"] == 1.0
