"""The belt from above on the live page: its values in the diagram of the conveyor."""

import json

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from drake_tracker import load_scenario, make_diagram
from drake_tracker.arm.arm_model import make_arm_model
from drake_tracker.arm.description import PUMA560
from drake_tracker.core.part_kinds import PART_SHAPES, PartKind
from drake_tracker.live.overview_system import SAMPLE_PERIOD, add_overview
from drake_tracker.tasks.conveyor.overview import CONVEYOR_OVERVIEW
from drake_tracker.world.conveyor.conveyor_config import cell_centres


def test_the_page_gets_what_stands_still_and_what_changes():
    overrides = ["vision=!Measured {}", "belt.speed=0.15", "arrivals.rate=60", "arrivals.gap=0.005"]
    scenario = load_scenario("conveyor", seed=11, duration=4.0, overrides=overrides)
    hand_eye, builder, shown = make_diagram(scenario), DiagramBuilder(), []
    facts = CONVEYOR_OVERVIEW.facts(scenario, hand_eye)
    arrivals = hand_eye.world.arrivals
    builder.AddSystem(hand_eye)
    add_overview(
        builder, hand_eye=hand_eye, overview=CONVEYOR_OVERVIEW, model=make_arm_model(PUMA560), show=shown.append
    )
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(0.9)
    assert len(shown) == round(0.9 / SAMPLE_PERIOD) + 1

    facts, values = json.loads(json.dumps(facts)), json.loads(json.dumps(shown[-1]))
    assert len(facts["parts"]) == len(arrivals) and len(facts["cells"]) == len(cell_centres(scenario.tray))
    width = np.ptp(facts["outlines"][str(int(PartKind.BOX))], axis=0)[1]
    assert width == PART_SHAPES[PartKind.BOX].width
    number, kind, x, y, _, clear = values["seen"][0]
    index, true_x, true_y, _ = next(each for each in values["true"] if each[0] == number - 1)
    assert kind == facts["parts"][index][0] == int(arrivals[index].kind)
    assert abs(x - true_x) < 0.01 and abs(y - true_y) < 0.01 and clear > 0.0
    assert values["order"] == number and facts["cells"][values["cell"]][1] < 0.0
    assert values["picked"] == values["placed"] == 0 and values["per_minute"] == 0.0
    assert facts["x"][0] < values["hand"][0] < facts["x"][1] and values["hand"][3] > 0.08
