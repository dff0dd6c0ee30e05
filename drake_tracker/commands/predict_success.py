"""``drake-tracker predict-success``: predicts how often a grasp succeeds, before anything is built."""

from argparse import Namespace

from drake_tracker.commands.common import SUCCESS, Commands, add_command, add_overrides, quiet_drake
from drake_tracker.core.errors import DrakeTrackerError

_LIMITS = {"lag": "the lag", "noise": "the noise", "bends": "bends that no filter foresees", "arm": "the arm"}
"""{key of `limiting`: its name}."""
LARGEST = {"speed": 2.0, "lag": 2.0, "noise": 0.1, "curvature": 100.0, "straight": 5.0}
"""Largest value of each option."""


def register(commands: Commands) -> None:
    """Adds the command to the parsers ``commands``."""
    command = add_command(
        commands,
        "predict-success",
        execute,
        help="predict how often a grasp would succeed",
        description="Predicts how often the first descent to a moving object lifts it, from the lag and the noise of "
        "vision, the object's speed and path, and the arm; and says which of these limits it. The path has straights "
        "and quarter bends in turn; of the track's settings only the speed counts. No run is simulated.",
        next_step="drake-tracker run train:guided --set track.speed=0.2 simulates one such grasp.",
    )
    command.add_argument("--speed", type=float, help="of the object (default: track.speed, 0.15) [m/s]")
    command.add_argument("--lag", type=float, help="of vision (default: vision.lag_cycles / 60, 0.25) [s]")
    command.add_argument(
        "--noise", type=float, default=0.0015, help="standard deviation of a point, per axis (default: 0.0015) [m]"
    )
    command.add_argument(
        "--curvature", type=float, default=8.0, help="of the path's quarter bends (default: 8; 0: straight on) [1/m]"
    )
    command.add_argument("--straight", type=float, default=0.15, help="between two bends (default: 0.15) [m]")
    command.add_argument("--arm", default="Puma560", metavar="TAG", help="the arm, as for --set arm=TAG")
    command.add_argument("--known", action="store_true", help="the filter has learned the path from an earlier lap")
    add_overrides(command)


def execute(options: Namespace) -> int:
    """Prints the prediction; returns the exit code."""
    quiet_drake()
    from drake_tracker.arm.description import ARMS
    from drake_tracker.core.timing import VISION_PERIOD
    from drake_tracker.estimation.config import AlphaBetaGamma
    from drake_tracker.grasp.success_law import LAW, UNCERTAINTY, Situation, bends, joint_shares, limiting, predict
    from drake_tracker.tasks import load_scenario
    from drake_tracker.tasks.train.setup import resolve

    for name, largest in LARGEST.items():
        value = getattr(options, name)
        if value is not None and not 0.0 <= value <= largest:
            raise DrakeTrackerError(f"--{name} {value:g}: must be from 0 to {largest:g}")
    kinds = {settings.__name__.lower(): settings.__name__ for settings in ARMS.names.values()}
    arm = kinds.get(options.arm.lower(), options.arm)
    scenario = load_scenario("train:guided", overrides=[f"arm={arm}", *options.overrides])
    setup = resolve(scenario)
    situation = Situation(
        scenario.track.speed if options.speed is None else options.speed,
        scenario.vision.lag_cycles * VISION_PERIOD if options.lag is None else options.lag,
        options.noise,
        bends(options.curvature, options.straight),
        joint_shares(setup.reach.model, setup.reach.q_initial),
        setup.grasp,
        options.known,
        isinstance(scenario.estimator, AlphaBetaGamma),
    )
    success, bound = predict(LAW, situation)
    low, high = max(success - UNCERTAINTY, 0.0), min(success + UNCERTAINTY, 1.0)
    limit, without = next(iter(limiting(LAW, situation).items()))
    print(f"{'success':<20}{100 * success:.0f} % ({100 * low:.0f} to {100 * high:.0f} %)")
    said = f"{_LIMITS[limit]}: {100 * without:.0f} % without" if without > success + 0.005 else "nothing"
    print(f"{'limited by':<20}{said}")
    print(f"{'perfect prediction':<20}{100 * bound:.0f} %, what the arm can follow")
    return SUCCESS
