"""``drake-tracker dataset``: records episodes of a policy as a data set for LeRobot."""

import sys
from argparse import BooleanOptionalAction, Namespace
from contextlib import suppress
from pathlib import Path

from drake_tracker.commands import common
from drake_tracker.core.errors import DrakeTrackerError, load_extra
from drake_tracker.core.processes.signals import exit_code

LATENCY = ("camera_lag", "inference_time", "link_delay")
PLAN = ("scenario", "overrides", "policy", "images", "first_seed", *LATENCY)
"""Options that must not change when a data set is continued."""


def register(commands: common.Commands) -> None:
    """Adds the command to the parsers ``commands``."""
    command = common.add_command(
        commands,
        "dataset",
        execute,
        help="record episodes of a policy as a data set for LeRobot",
        description="Runs a policy and writes every episode, successful or not, in LeRobot's format v3.0. Run it again "
        "with the same arguments, perhaps with a greater N, to continue.",
        next_step="drake-tracker run SCENARIO --seed N records the run of the scenario's own controller.",
    )
    common.add_scenario(command)
    command.add_argument("--episodes", type=int, required=True, metavar="N", help="number of episodes")
    names = "1991, guided, straight_line, last_point or truth"
    command.add_argument("--policy", required=True, metavar="P", help=names)
    command.add_argument("-o", "--out", type=Path, required=True, metavar="DIR", help="new, or to be continued")
    images = "write videos of the cameras (default), or measure without images, which is fast"
    command.add_argument("--images", action=BooleanOptionalAction, default=True, help=images)
    command.add_argument("--first-seed", type=int, default=0, metavar="N", help="first of the seeds (default: 0)")
    lag = "time from an image to its observation [s] (default: that of the scenario)"
    command.add_argument("--camera-lag", type=float, metavar="S", help=lag)
    for option, what in (("--inference-time", "for which the policy computes"), ("--link-delay", "of the link")):
        command.add_argument(option, type=float, default=0.0, metavar="S", help=f"time {what} [s] (default: 0)")


def execute(options: Namespace) -> int:
    """Records the episodes; returns the exit code."""
    common.one_thread()

    from drake_tracker.campaign.plan import VISIONS
    from drake_tracker.campaign.table import require_parquet
    from drake_tracker.core.progress import StepsProgress
    from drake_tracker.tasks import load_scenario

    count, out = options.episodes, options.out
    if count < 1:
        raise DrakeTrackerError(f"--episodes {count}: must be a whole number from 1")
    if not 0 <= options.first_seed <= 2**32 - count:
        raise DrakeTrackerError(f"--first-seed {options.first_seed}: seeds must be from 0 to {2**32 - 1}")
    overrides = options.overrides if options.images else [VISIONS["measured"], *options.overrides]
    try:
        scenario = load_scenario(options.scenario, overrides=overrides, allow_code=options.allow_code)
    except DrakeTrackerError as error:
        raise DrakeTrackerError(str(error).replace(f"--set {VISIONS['measured']}", "--no-images")) from None
    common.announce_code(scenario)
    require_parquet("a data set", "dataset")
    load_extra("gymnasium", "dataset", "a data set")

    from drake_tracker.environments.dataset import DataSet
    from drake_tracker.environments.environment import TrackerEnvironment
    from drake_tracker.environments.policies import make_policy

    common.quiet_drake()
    parts = [*(["images"] if options.images else []), *(["truth"] if options.policy == "truth" else [])]
    observe, latency = ("joints", "points", *parts), {name: getattr(options, name) for name in LATENCY}
    env = TrackerEnvironment(options.scenario, overrides, observe=observe, allow_code=options.allow_code, **latency)
    policy, say = make_policy(options.policy, env), StepsProgress().say
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise DrakeTrackerError(f"the data set directory {out} cannot be made: {error.strerror}") from None
    try:
        with common.locked(out, f"the data set directory {out}"):
            data_set = DataSet(out, env, {name: getattr(options, name) for name in PLAN}, count)
            for seed in range(options.first_seed + len(data_set.rows), options.first_seed + count):
                data_set.record(policy, seed)
                row = data_set.rows[-1]
                verdict = f"{'success' if row['success'] else 'failure'}, {row['reason'] or 'the time was over'}"
                say(f"episode {len(data_set.rows)} of {count}, seed {seed}, {row['length']} frames: {verdict}")
    except KeyboardInterrupt:
        print("drake-tracker: interrupted; finished episodes are kept, the same command continues", file=sys.stderr)
        return exit_code()
    finally:
        env.close()
        with suppress(OSError):  # as a rule, it is not empty
            out.rmdir()
    successes = sum(row["success"] for row in data_set.rows)
    print(f"episodes  {count}, {successes} of them successful, {data_set.frames} frames")
    print(f"data set  {out}")
    return common.SUCCESS
