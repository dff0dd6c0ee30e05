"""Tests of layouts whose bodies overlap: contact would jam a belt, a train or an arm."""

from dataclasses import replace

import pytest

from drake_tracker import load_scenario, make_diagram
from drake_tracker.arm.description import FINGERS, PUMA560, SEVEN_JOINT, ArmDescription
from drake_tracker.core.errors import DrakeTrackerError


@pytest.mark.parametrize(
    "settings", [["belt.width=0.4"], ["tray.columns=6"], ["belt.width=0.3", "belt.middle=0.5"], ["belt.middle=0.45"]]
)
def test_a_belt_within_its_trays_is_refused(settings):
    with pytest.raises(DrakeTrackerError, match=r"layout is impossible: belt and tray_\d overlap by \d+ mm at the st"):
        make_diagram(load_scenario("conveyor:measured", overrides=settings))


@pytest.mark.parametrize("settings", [[], ["tray.rows=12"], ["belt.height=0.3"]])
def test_other_layouts_are_built(settings):
    make_diagram(load_scenario("conveyor:measured", overrides=settings))


def seven_with_jaws() -> ArmDescription:
    fingers = {name: getattr(PUMA560, name) for name in ("gripper_url", "finger_stiffness", "finger_damping")}
    return replace(SEVEN_JOINT, fingers=FINGERS, **fingers)


@pytest.mark.parametrize("arm", ["UR5e", f"!Custom {{call: {__name__}.seven_with_jaws}}"])
def test_a_train_is_compared_where_it_starts_and_not_at_the_base_of_an_arm(arm):
    make_diagram(load_scenario("train", overrides=["vision=!Measured {}", f"arm={arm}"]))


def test_a_train_that_starts_in_another_one_is_refused():
    track = "kind: oval, start: 0.2, direction: forward, centre_range: 0, rotation_range_deg: 0"
    same = ["track.start=0.2", "track.direction=forward", "track.centre_range=0", "track.rotation_range_deg=0"]
    scenario = load_scenario(
        "train", overrides=["vision=!Measured {}", *same, f"objects=[!Train {{track: {{{track}}}}}]"]
    )
    with pytest.raises(
        DrakeTrackerError, match=r"layout is impossible: train and train overlap by \d+ mm at the start"
    ):
        make_diagram(scenario)
