from dataclasses import replace

import pytest

from drake_tracker.world.conveyor.conveyor_config import BeltConfig, TrayConfig, cell_at, cell_centres
from drake_tracker.world.conveyor.part_fates import REST_TIME, PartFate, PartView, held_parts, next_fate

BELT, TRAY = BeltConfig(), TrayConfig()
BOTH, LEFT, RIGHT = frozenset((0, 1)), frozenset((0,)), frozenset((1,))
ON_BELT = PartView(x=0.6, y=0.0, rise=0.0, tilt=0.0, speed=0.15, fingers=frozenset(), on_belt=True)
UPSTREAM = replace(ON_BELT, y=-0.5)
PAST = replace(ON_BELT, y=0.51)
GRIPPED = replace(ON_BELT, fingers=BOTH)
LIFTED = replace(GRIPPED, rise=0.05, on_belt=False)
FALLING = replace(LIFTED, fingers=frozenset(), speed=0.5)
IN_CELL = replace(ON_BELT, x=0.345, y=0.19, speed=0.0, on_belt=False)
ON_TABLE = replace(IN_CELL, x=0.45, y=0.0, rise=-0.03)
ON_WALL = replace(IN_CELL, tilt=0.2, rise=0.006)
ON_PART = replace(ON_BELT, rise=0.025, speed=0.0, on_belt=False)


def fate_after(*views):
    """The fate of a part that is seen in a row; it keeps its last place until it has rested long enough."""
    fate, rested = PartFate.UPSTREAM, 0.0
    for view in (*views, views[-1]):
        rested = REST_TIME if view.speed == 0.0 else 0.0
        fate = next_fate(fate, view, held=bool(held_parts([view])), rested=rested, belt=BELT, tray=TRAY)
    return fate


@pytest.mark.parametrize(
    "views, fate",
    [
        ([UPSTREAM], PartFate.UPSTREAM),
        ([UPSTREAM, ON_BELT], PartFate.ON_BELT),
        ([ON_BELT, GRIPPED], PartFate.ON_BELT),
        ([ON_BELT, PAST], PartFate.MISSED),
        ([ON_BELT, ON_PART], PartFate.ON_BELT),
        ([ON_BELT, GRIPPED, LIFTED], PartFate.HELD),
        ([ON_BELT, LIFTED, FALLING], PartFate.HELD),
        ([ON_BELT, LIFTED, FALLING, ON_BELT], PartFate.DROPPED),
        ([ON_BELT, LIFTED, GRIPPED], PartFate.HELD),
        ([ON_BELT, LIFTED, ON_BELT, PAST], PartFate.DROPPED),
        ([ON_BELT, LIFTED, ON_BELT, LIFTED], PartFate.HELD),
        ([ON_BELT, LIFTED, IN_CELL], PartFate.PLACED),
        ([ON_BELT, LIFTED, replace(IN_CELL, fingers=LEFT)], PartFate.HELD),
        ([ON_BELT, LIFTED, IN_CELL, replace(IN_CELL, fingers=RIGHT)], PartFate.PLACED),
        ([ON_BELT, LIFTED, IN_CELL, ON_TABLE], PartFate.DROPPED),
        ([ON_BELT, LIFTED, ON_WALL], PartFate.DROPPED),
        ([ON_BELT, LIFTED, ON_TABLE], PartFate.DROPPED),
        ([ON_BELT, ON_TABLE], PartFate.DROPPED),
        ([ON_BELT, replace(ON_TABLE, speed=0.1)], PartFate.ON_BELT),
    ],
)
def test_fates(views, fate):
    assert fate_after(*views) is fate


def test_parts_between_the_fingers_are_held_together():
    left, right = replace(LIFTED, fingers=LEFT), replace(LIFTED, fingers=RIGHT)
    assert held_parts([ON_BELT, LIFTED]) == [1]
    assert held_parts([left, ON_BELT, right]) == [0, 2]
    assert held_parts([left, ON_BELT]) == []
    assert held_parts([LIFTED, replace(IN_CELL, fingers=LEFT)]) == [0]
    assert held_parts([]) == []


def test_cells():
    centres = cell_centres(TRAY)
    assert len(centres) == 24
    assert centres[0] == pytest.approx([0.345, 0.19]) and centres[1] == pytest.approx([0.410, 0.19])
    assert centres[12] == pytest.approx([0.345, -0.19]) and centres[-1] == pytest.approx([0.410, -0.515])
    assert [cell_at(TRAY, *centre) for centre in centres] == list(range(24))
    assert cell_at(TRAY, 0.345 + 0.030, 0.19) == 0
    assert cell_at(TRAY, 0.345 + 0.0325, 0.19) is None
    assert cell_at(TRAY, 0.6, 0.0) is None
