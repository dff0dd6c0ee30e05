"""Tests of layouts whose bodies overlap: contact would jam a belt, a train or an arm."""

import pytest

from drake_tracker import load_scenario, make_diagram
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
