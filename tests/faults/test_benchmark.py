"""The benchmark of the faults: what it injects can be loaded, and its verdict on a run."""

import pytest
from result_tables import fault_tables
from result_tables.fault_tables import FAULTS, faults_table, is_good

from drake_tracker import load_scenario
from drake_tracker.faults.kinds import FAULTS as KINDS
from drake_tracker.tasks.train.diagnosis.trouble import Cause

GOOD = {
    "fault": "link-loss",
    "vision": "measured",
    "seed": 1,
    "success": False,
    "cause": "link",
    "phase": "HOVER",
    "speed_share": 0.8,
    "longest_saturation_s": 0.01,
    "joint_limit_margin_rad": 0.2,
    "table_touched": False,
    "self_touched": False,
}


def test_every_kind_of_the_train_is_injected_and_every_cause_exists():
    kinds = set()
    for fault in FAULTS.values():
        (item,) = load_scenario("train:learned", overrides=[f"faults=[{fault.tag}]"]).faults
        kinds.add(type(item))
        assert set(fault.causes) <= set(Cause)
    assert kinds == {kind for kind in KINDS.makers if "train" in kind.tasks}
    assert sum("measured" in fault.visions for fault in FAULTS.values()) >= 16


@pytest.mark.parametrize(
    "changes, good",
    [
        ({}, True),
        ({"success": True, "cause": None, "phase": "HOLD"}, True),
        ({"cause": "camera"}, False),
        ({"phase": "CLOSE", "simulated_s": 20.0}, False),
        ({"phase": "CLOSE", "simulated_s": 40.0}, True),
        ({"speed_share": 1.01}, False),
        ({"longest_saturation_s": 0.05}, False),
        ({"table_touched": True}, False),
        ({"self_touched": True}, False),
        ({"joint_limit_margin_rad": -0.01}, False),
        ({"success": True, "phase": "HOLD", "table_touched": True}, False),
    ],
)
def test_a_run_is_good_when_it_lifts_or_stays_safe_and_names_the_right_cause(changes, good):
    assert is_good(GOOD | changes) is good


def test_a_run_that_ended_with_an_exception_is_bad():
    broken = {"fault": "link-loss", "vision": "measured", "seed": 2, "success": False, "phase": None}
    assert not is_good(broken)
    header, rows = faults_table([GOOD, broken, GOOD | {"cause": "camera"}])
    assert rows[0][header.index("runs") :] == [3, 0, 1, 1, 1, 1, fault_tables.interval(1, 3)]


@pytest.mark.parametrize(
    ("changes", "acted", "named"),
    [
        ({}, True, False),
        ({"further_causes": ["camera"]}, True, True),
        ({"simulated_s": 4.9}, False, False),  # the images froze 4 s earlier than in other scenarios, at 2 s
        ({"fault": "link-loss + slow-gripper"}, False, False),
        ({"fault": "link-loss + slow-gripper", "attempts": 1, "further_causes": ["gripper"]}, True, True),
    ],
)
def test_a_pair_is_judged_where_both_faults_could_show(changes, acted, named):
    run = GOOD | {"fault": "link-loss + frozen-image", "scenario": "train:guided", "attempts": 0, "simulated_s": 40.0}
    run |= changes
    assert fault_tables.both_acted(run) is acted
    assert fault_tables.both_named(run) is named
