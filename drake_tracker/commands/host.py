"""``drake-tracker host``: runs the image processor and the host computer, with the arm in another process."""

from argparse import Namespace

from drake_tracker.commands.common import (
    NOT_TAKEN,
    SUCCESS,
    Commands,
    add_command,
    add_lcm,
    add_scenario,
    announce_code,
    quiet_drake,
)
from drake_tracker.core.processes.signals import on_signal


def register(commands: Commands) -> None:
    """Adds the command to the parsers ``commands``."""
    command = add_command(
        commands,
        "host",
        execute,
        help="run the image processor and the host computer, with `arm` in another process",
        description="Receives the images of `drake-tracker arm` over LCM, or its points with measured vision, and "
        "answers with packets of predicted path until Ctrl-C. Use the scenario and the settings of the arm.",
        next_step="drake-tracker arm SCENARIO in another terminal, with the same scenario and settings.",
    )
    add_scenario(command)
    add_lcm(command)


def execute(options: Namespace) -> int:
    """Runs the host until Ctrl-C; returns the exit code."""
    from drake_tracker.tasks import load_scenario

    scenario = load_scenario(options.scenario, overrides=options.overrides, allow_code=options.allow_code)

    from drake_tracker.core.progress import Progress
    from drake_tracker.network.bus import open_bus
    from drake_tracker.run.host_process import HostProcess
    from drake_tracker.tasks.train.two_processes import code_of_host

    announce_code(scenario, code_of_host(scenario))
    quiet_drake()
    stopped: list[int] = []
    progress = Progress(scenario.duration)

    def tell(line: str) -> None:
        nonlocal progress
        progress.close()
        progress = Progress(scenario.duration)  # its real-time factor is measured from this message on
        print(f"host: {line}", flush=True)

    try:
        with on_signal(stopped.append):
            host = HostProcess(scenario, open_bus(options.lcm), open_bus(options.lcm), tell)
            tell("waiting for an arm; Ctrl-C ends")
            with host.mailbox.listening():
                while not stopped:
                    if host.step():
                        progress(host.time, f"{host.counts['packets']} packets")
    finally:
        progress.close()
    for name, count in host.counts.items():
        print(f"{name.replace('_', ' '):<18}{count}")
    return SUCCESS if host.counts["cycles"] else NOT_TAKEN
