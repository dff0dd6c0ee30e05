"""``drake-tracker host``: the image processor and the host computer, with the arm in another process."""

import signal

from drake_tracker.commands.common import NOT_TAKEN, SUCCESS, add_lcm, add_scenario


def register(commands):
    """Adds the command to the parsers ``commands``."""
    command = commands.add_parser(
        "host",
        help="run the image processor and the host computer, with `arm` in another process",
        description="Takes the images that `drake-tracker arm` sends over LCM, or its points with measured vision, and "
        "answers with packets of predicted path, until Ctrl-C. Start it with the scenario and the settings of the arm.",
    )
    add_scenario(command)
    add_lcm(command)
    command.set_defaults(action=execute)


def execute(options):
    from drake_tracker.tasks import load_scenario

    scenario = load_scenario(options.scenario, overrides=options.overrides)

    from drake_tracker.core.progress import Progress
    from drake_tracker.network.bus import open_bus
    from drake_tracker.run.host_process import HostProcess

    stopped = []
    previous = signal.signal(signal.SIGINT, lambda *_: stopped.append(True))
    progress = Progress(scenario.duration)

    def tell(line):
        nonlocal progress
        progress.close()
        progress = Progress(scenario.duration)  # its rate counts from the news on
        print(f"host: {line}", flush=True)

    try:
        host = HostProcess(scenario, open_bus(options.lcm), open_bus(options.lcm), tell)
        tell("waits for an arm; Ctrl-C ends")
        with host.mailbox.listening():
            while not stopped:
                if host.step():
                    progress(host.time, f"{host.counts['packets']} packets")
    finally:
        progress.close()
        signal.signal(signal.SIGINT, previous)
    for name, count in host.counts.items():
        print(f"{name.replace('_', ' '):<18}{count}")
    return SUCCESS if host.counts["cycles"] else NOT_TAKEN
