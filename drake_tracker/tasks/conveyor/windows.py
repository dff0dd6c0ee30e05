"""When the parts of a run could be picked, and how many of them at most."""

from collections.abc import Sequence

from drake_tracker.dispatch import arrivals as queue
from drake_tracker.dispatch.candidate import Candidate, Cell, FreeHand
from drake_tracker.dispatch.cycle_time import CycleModel
from drake_tracker.dispatch.offline_optimum import offline_optimum
from drake_tracker.tasks.conveyor.diagram import filling_order
from drake_tracker.tasks.conveyor.scenario import ConveyorScenario
from drake_tracker.world.conveyor.arrivals import Arrival
from drake_tracker.world.conveyor.belt_motion import BeltMotion, make_belt_motion
from drake_tracker.world.conveyor.tray import cell_centres


def window_times(scenario: ConveyorScenario, arrival: Arrival, motion: BeltMotion) -> tuple[float, float]:
    """Returns when the belt carries a part into the picking window, and out of it [s].

    Args:
        scenario: the scenario of the run.
        arrival: of the part.
        motion: of the belt.
    """
    before = motion.distance(arrival.time) - scenario.belt.entry
    window = scenario.window
    return motion.time_at(max(before + window.y_first, 0.0)), motion.time_at(max(before + window.y_last, 0.0))


def placing_time(scenario: ConveyorScenario) -> float:
    """Returns the time from a pick at the end of the window until the part is in the farthest cell [s].

    Args:
        scenario: the scenario of the run.
    """
    model = CycleModel(scenario.cycle, scenario.window)
    part = Candidate(1, 1, scenario.belt.middle, scenario.window.y_last, 0.0, 0.0, 0.0, 1.0)
    return max(model.place_time(part, 0.0, Cell(x, y), 0.0) for x, y in cell_centres(scenario.tray))


def could_be_picked(scenario: ConveyorScenario, arrival: Arrival, simulated: float) -> bool:
    """Returns whether a part stands, and the whole chance to pick and place it lay within the run.

    Args:
        scenario: the scenario of the run.
        arrival: of the part.
        simulated: time at which the run ended [s].
    """
    _, leaves = window_times(scenario, arrival, make_belt_motion(scenario.belt))
    return not arrival.lies and leaves + placing_time(scenario) <= simulated


def clairvoyant_picks(scenario: ConveyorScenario, arrivals: Sequence[Arrival], simulated: float) -> int | None:
    """Returns the largest number of picks of an arm that knows all arrivals, or None for a belt that changes its speed.

    The arm needs the time of a cycle that the dispatcher expects, fails at no pick, and has room beside every part. It
    leaves parts that lie on a side.

    Args:
        scenario: the scenario of the run.
        arrivals: the parts of the run.
        simulated: time at which the run ended [s].
    """
    belt, window = scenario.belt, scenario.window
    if belt.motion != "running":
        return None
    parts = [
        queue.PartArrival(number, arrival.time, arrival.x, belt.speed)
        for number, arrival in enumerate(arrivals, 1)
        if arrival.time <= simulated and not arrival.lies
    ]
    centres = cell_centres(scenario.tray)
    cells = [Cell(*centres[k]) for k in filling_order(scenario)]
    hand = FreeHand(belt.middle, window.y_wait, 0.0)
    bound = offline_optimum(CycleModel(scenario.cycle, window), parts, hand, cells, belt.entry, simulated)
    return min(bound.upper, len(cells))
