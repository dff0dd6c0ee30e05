"""The times in which the parts of a run could be picked, and the largest number of picks."""

from collections.abc import Sequence

from drake_tracker.dispatch import arrivals as queue
from drake_tracker.dispatch.candidate import Candidate, Cell, FreeHand
from drake_tracker.dispatch.cycle_time import CycleModel
from drake_tracker.dispatch.offline_optimum import offline_optimum
from drake_tracker.tasks.conveyor.setup import ConveyorSetup
from drake_tracker.world.conveyor.arrivals import Arrival
from drake_tracker.world.conveyor.belt_motion import BeltMotion, make_belt_motion
from drake_tracker.world.conveyor.conveyor_config import cell_centres


def window_times(setup: ConveyorSetup, arrival: Arrival, motion: BeltMotion) -> tuple[float, float]:
    """Returns when the belt carries a part into the picking window, and out of it [s].

    Args:
        setup: the resolved scenario of the run.
        arrival: of the part.
        motion: of the belt.
    """
    before = motion.distance(arrival.time) - setup.scenario.belt.entry
    window = setup.scenario.window
    return motion.time_at(max(before + window.y_first, 0.0)), motion.time_at(max(before + window.y_last, 0.0))


def placing_time(setup: ConveyorSetup) -> float:
    """Returns the time from a pick at the end of the window until the part is in the farthest cell [s].

    Args:
        setup: the resolved scenario of the run.
    """
    model = CycleModel(setup.scenario.cycle, setup.scenario.window)
    part = Candidate(1, 1, setup.scenario.belt.middle, setup.scenario.window.y_last, 0.0, 0.0, 0.0, 1.0)
    return max(model.place_time(part, 0.0, Cell(x, y), 0.0) for x, y in cell_centres(setup.scenario.tray))


def could_be_picked(setup: ConveyorSetup, arrival: Arrival, simulated: float) -> bool:
    """Returns whether a part stands, and the whole chance to pick and place it lay within the run.

    Args:
        setup: the resolved scenario of the run.
        arrival: of the part.
        simulated: time at which the run ended [s].
    """
    _, leaves = window_times(setup, arrival, make_belt_motion(setup.scenario.belt))
    return not arrival.lies and leaves + placing_time(setup) <= simulated


def clairvoyant_picks(setup: ConveyorSetup, arrivals: Sequence[Arrival], simulated: float) -> int | None:
    """Returns the largest number of picks of an arm that knows all arrivals, or None for a belt that changes its speed.

    The arm needs the time of a cycle that the dispatcher expects, fails at no pick, and has room beside every part. It
    leaves parts that lie on a side.

    Args:
        setup: the resolved scenario of the run.
        arrivals: the parts of the run.
        simulated: time at which the run ended [s].
    """
    belt, window = setup.scenario.belt, setup.scenario.window
    if belt.motion != "running":
        return None
    parts = [
        queue.PartArrival(number, arrival.time, arrival.x, belt.speed)
        for number, arrival in enumerate(arrivals, 1)
        if arrival.time <= simulated and not arrival.lies
    ]
    centres = cell_centres(setup.scenario.tray)
    cells = [Cell(*centres[k]) for k in setup.filling_order]
    hand = FreeHand(belt.middle, window.y_wait, 0.0)
    bound = offline_optimum(CycleModel(setup.scenario.cycle, window), parts, hand, cells, belt.entry, simulated)
    return min(bound.upper, len(cells))
