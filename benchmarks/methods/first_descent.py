"""The first descent of a run of the train, for `launches.py` and `success_law.py`."""

import math

from pydrake.systems.analysis import Simulator

from drake_tracker import make_diagram
from drake_tracker.core.messages import GraspDiagnosis, ServoTarget, Verdict
from drake_tracker.core.timing import SERVO_PERIOD
from drake_tracker.grasp.train.schema import Phase


def first_descent(scenario, patience=math.inf):
    """Returns what the first descent of a run came to: {"launch_s", "probability", "lifted", "end"}, the first two None
    without a launch until ``patience`` [s]."""
    diagram = make_diagram(scenario)
    simulator = Simulator(diagram)
    context = simulator.get_mutable_context()
    diagnosis = lambda: GraspDiagnosis(diagram.GetOutputPort("diagnosis").Eval(context))  # noqa: E731
    verdict = lambda: Verdict(diagram.GetOutputPort("truth_verdict").Eval(context))  # noqa: E731
    launch, probability, target = None, None, None
    before = 0.0
    while context.get_time() < (scenario.duration if launch is not None else min(patience, scenario.duration)):
        simulator.AdvanceTo(min(context.get_time() + SERVO_PERIOD, scenario.duration))
        seen = diagnosis()
        phase = Phase(int(seen.phase))
        if launch is None and phase == Phase.INTERCEPT:
            launch, probability = context.get_time(), before
            target = ServoTarget(diagram.GetOutputPort("target").Eval(context))
        if launch is not None and phase in (Phase.RETREAT, Phase.HOLD, Phase.ACQUIRE):
            end = "lifted" if phase == Phase.HOLD and verdict().held else "missed"
            return {
                "launch_s": round(launch, 2),
                "age_s": round(float(target.time - target.stamp), 4),
                "probability": round(float(probability), 4),
                "lifted": end == "lifted",
                "end": end,
            }
        if verdict().derailed:
            break
        before = float(seen.p_success)
    end = "derailed" if verdict().derailed else "no launch" if launch is None else "ended"
    found = {"launch_s": None, "age_s": None, "probability": None, "lifted": False, "end": end}
    if launch is not None:
        found |= {"launch_s": round(launch, 2), "probability": round(float(probability), 4)}
    return found
