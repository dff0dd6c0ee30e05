"""``drake-tracker lag``: measures the latency of a camera."""

from argparse import Namespace
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drake_tracker.commands.common import SUCCESS, Commands, add_command, warn
from drake_tracker.core.errors import DrakeTrackerError

if TYPE_CHECKING:
    from drake_tracker.cameras.latency.measurement import LatencyMeasurement

LIVE_DURATION = 30.0
"""Time for which a live camera is watched unless the user says otherwise [s]."""
PATIENCE = 120.0
"""Longest time to wait until the page with the code is in view [s]."""
GOOD = 0.003
"""Uncertainty that needs no warning [s]; above, the screen's refresh limits it."""


def register(commands: Commands) -> None:
    """Adds the command to the parsers ``commands``."""
    command = add_command(
        commands,
        "lag",
        execute,
        help="measure the latency of your own cameras",
        description="Measures how late the stamps of a camera's images are. A live camera must see a page on this "
        "machine's screen, whose address is printed; a file is a recording of that page. With --light, the camera "
        "must see a light that this machine switches.",
        next_step="drake-tracker track LEFT RIGHT --calibration FILE subtracts the latencies in FILE from the stamps.",
    )
    command.add_argument(
        "source", nargs="*", metavar="SOURCE", help="footage of the left or only camera; then of the right one"
    )
    command.add_argument("--show", action="store_true", help="only show the page with the running code, until Ctrl-C")
    command.add_argument("--calibration", metavar="FILE", help="write the latencies into this calibration file")
    command.add_argument(
        "--camera", default="camera_left", metavar="NAME", help="name of a single camera in the calibration"
    )
    command.add_argument(
        "--duration", type=float, metavar="S", help=f"time to measure [s] (live: {LIVE_DURATION:g}; file: all of it)"
    )
    command.add_argument("--port", type=int, default=0, metavar="N", help="port of the page (default: a free one)")
    command.add_argument("--fps", type=float, metavar="N", help="images per second, where the source does not say")
    command.add_argument(
        "--light", metavar="FILE", help="switch a light by writing 1 and 0 to this file, such as "
        "/sys/class/leds/NAME/brightness"
    )  # fmt: skip
    command.add_argument(
        "--times", type=Path, metavar="CSV", help="times of the switched light: written for a live camera, read for a "
        "file"
    )  # fmt: skip


def execute(options: Namespace) -> int:
    """Measures the latency; returns the exit code."""
    _check(options)
    if options.show:
        return _show(options.port)
    from drake_tracker.footage.sources import is_same_source, open_footage

    if len(options.source) == 2 and is_same_source(*options.source):
        raise DrakeTrackerError(f"{options.source[0]} and {options.source[1]} are the same images")
    names = ["camera_left", "camera_right"] if len(options.source) == 2 else [options.camera]
    if options.calibration:
        _check_calibration(options.calibration, names)
    measured: list[LatencyMeasurement] = []
    with ExitStack() as page:
        for spec in options.source:  # one after the other: a busy machine would delay the images of both
            footage = open_footage(spec, options.fps)
            try:
                if footage.live and not options.light and not measured:
                    _announce(page, options.port)
                measured.append(_measure(footage, options))
            finally:
                footage.close()
    for name, each in zip(names, measured):
        _report(name, each)
    if len(measured) == 2 and not all(each.absolute for each in measured):
        offset = measured[0].latency.seconds - measured[1].latency.seconds
        print(f"{'offset':<14}the right recording began {offset:.4f} s later: track ... --offset {offset:.4f}")
    if options.calibration:
        _save(options.calibration, names, measured)
    return SUCCESS


def _check(options: Namespace) -> None:
    """Raises DrakeTrackerError when the options do not belong together."""
    if options.show and options.source:
        raise DrakeTrackerError("lag: --show takes no source; it only shows the page")
    if not options.show and not 1 <= len(options.source) <= 2:
        raise DrakeTrackerError(f"lag: {len(options.source)} sources; give one or two, or --show")
    for name in ("duration", "fps"):
        value = getattr(options, name)
        if value is not None and not 0.0 < value < float("inf"):
            raise DrakeTrackerError(f"--{name} {value:g}: must be above 0 and finite")


def _check_calibration(path: str, names: Sequence[str]) -> None:
    """Raises DrakeTrackerError when a calibration file cannot receive the latencies."""
    from drake_tracker.cameras.files.calibration_file import load_calibration

    found = load_calibration(path)
    for name in names:
        if name not in found:
            raise DrakeTrackerError(f"{path}: there is no {name}; found {', '.join(found) or 'none'} (--camera NAME)")


def _announce(stack: ExitStack, port: int) -> None:
    """Serves the page with the running code until ``stack`` is closed, and prints its address."""
    from drake_tracker.cameras.latency.page_server import CodeServer

    server = stack.enter_context(CodeServer(port))
    print(f"Running code: {server.url}  (open it on this machine's screen; Ctrl-C ends)", flush=True)


def _show(port: int) -> int:
    import time

    with ExitStack() as page:
        _announce(page, port)
        while True:
            time.sleep(1.0)


def _measure(footage: Any, options: Namespace) -> "LatencyMeasurement":
    """Returns the `LatencyMeasurement` of one camera."""
    from drake_tracker.cameras.latency.light import SwitchedLight, read_switches, write_switches
    from drake_tracker.cameras.latency.measurement import measure_by_code, measure_by_light
    from drake_tracker.core.progress import Progress

    duration = options.duration or (LIVE_DURATION if footage.live else None)
    if options.light and not footage.live:
        raise DrakeTrackerError(f"--light {options.light}: {footage.name} is not live; give the --times of the light")
    if footage.live and options.times and not options.light:
        raise DrakeTrackerError(f"--times {options.times}: for a live camera the light is missing: --light FILE")
    with ExitStack() as stack:
        if options.light:
            light = stack.enter_context(SwitchedLight(options.light))
            notice = stack.enter_context(_progress(Progress(duration or float("inf"))))
            measured = measure_by_light(footage, lambda: light.switches, duration=duration, notice=notice)
            if options.times:
                write_switches(options.times, light.switches)
            return measured
        if options.times:
            times, states = read_switches(options.times)
            switches = [(time, int(state)) for time, state in zip(times.tolist(), states.tolist())]
            return measure_by_light(footage, lambda: switches, duration=duration)
        end = float("inf") if footage.live else float(footage.times[-1])
        notice = stack.enter_context(_progress(Progress(end)))
        return measure_by_code(footage, duration=duration, patience=PATIENCE, notice=notice)


@contextmanager
def _progress(progress: Any) -> Iterator[Any]:
    try:
        yield lambda time, count: progress(time, f"{count} useful images")
    finally:
        progress.close()


def _report(name: str, measured: "LatencyMeasurement") -> None:
    """Prints the latency of a camera, and the cause of its uncertainty."""
    latency = measured.latency
    words = "latency" if measured.absolute else "clock"
    print(
        f"{name:<14}{words} {1e3 * latency.seconds:.1f} ms ± {1e3 * latency.uncertainty:.1f} ms "
        f"(one image: ± {1e3 * latency.spread:.1f} ms; {latency.images} useful of {measured.seen} images)"
    )
    if not measured.absolute:
        print(f"{'':<14}stamps of {measured.name} count from its first image: compare with another camera")
    if measured.refresh is not None and latency.uncertainty > GOOD:
        warn(
            f"{measured.name}: the images fall at the same instants of the screen's refresh "
            f"({1e3 * measured.refresh:.1f} ms), so that the latency is known to ± {1e3 * latency.uncertainty:.0f} ms "
            "only; measure longer (--duration), or at another rate of the camera (--fps) or of the screen"
        )


def _save(path: str, names: Sequence[str], measured: "Sequence[LatencyMeasurement]") -> None:
    """Writes the latencies into a calibration file."""
    from drake_tracker.cameras.latency.camera_latency import save_latency

    for each in measured:
        if not each.absolute:
            raise DrakeTrackerError(
                f"--calibration {path}: nothing was written; the stamps of {each.name} count from its first image, and "
                "not on a clock of this machine"
            )
    for name, each in zip(names, measured):
        save_latency(path, name, each.latency.seconds)
    print(f"wrote {path}")
