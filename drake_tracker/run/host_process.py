"""The host's process: takes what the laboratory's sensors send, and sends packets, at the pace of what it hears."""

import time
from collections.abc import Callable, Mapping
from typing import Any, NoReturn

from drake import lcmt_drake_signal, lcmt_image_array
from pydrake.lcm import DrakeLcm
from pydrake.systems.analysis import Simulator

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.messages import Prediction
from drake_tracker.core.timing import SERVO_SLOT, VISION_PERIOD, vision_slot
from drake_tracker.network.channels import channel_of
from drake_tracker.network.cycles import CycleCollector
from drake_tracker.network.mailbox import Mailbox
from drake_tracker.tasks.train.two_processes import make_host_side

SILENCE = 1.0
"""Wall time [s] without a message after which the arm counts as silent."""
MOST_WAITING = 60
"""Cycles that wait for their turn, at most: a host that is slower than the laboratory skips the oldest, rather than
fall behind without limit."""
_CAMERA = "camera_"


class HostProcess:
    """Image processor and host computer, driven by messages.

    The host has no clock of its own: its time is that of the messages. Each cycle that has come is played to a bus
    within this process, and the diagram advanced past the slots of that cycle, so that a subscriber, which keeps only
    the newest message, misses none, and that the same points give the same packets as in a single process. When the
    sender's clock goes back its laboratory began anew, and the host with it.

    Args:
      scenario: a TrainScenario. incoming, outgoing: a DrakeLcm each; two of them where a thread listens to the first.
      tell: called with a line of news. clock: returns the wall time [s].

    Attributes:
      mailbox: the `Mailbox` of what comes in. counts: {what: how many} of the summary.
    """

    def __init__(
        self,
        scenario: Any,
        incoming: DrakeLcm,
        outgoing: DrakeLcm,
        tell: Callable[[str], object] = print,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._tell, self._clock = tell, clock
        self._inside = DrakeLcm("memq://")
        self._side, self._image_sizes = make_host_side(scenario, self._inside, outgoing)
        self._done = vision_slot(SERVO_SLOT, scenario.time_step)
        self._simulator = Simulator(self._side)
        self._collector = CycleCollector(self._side.heard, VISION_PERIOD)
        self.mailbox = Mailbox(incoming, self._side.heard)
        self._next = 0
        self._last_heard: float | None = None
        self._silent = False
        self._stamp: float | None = None
        names = ("laboratories", "cycles", "cycles_incomplete", "packets", "not_understood", "skipped")
        self.counts = dict.fromkeys(names, 0)

    @property
    def time(self) -> float:
        """The sender's time [s] that the host has come to."""
        return self._simulator.get_context().get_time()

    def step(self, timeout: float = 0.1) -> int:
        """Waits up to ``timeout`` [s] for messages and works on all that came. Returns the number of cycles.

        Raises DrakeTrackerError when the images are not those of the scenario.
        """
        count = 0
        messages = self.mailbox.collect(timeout)
        late = len(messages) - MOST_WAITING * len(self._side.heard)
        if late > 0:
            if not self.counts["skipped"]:
                self._tell("slower than the arm sends: images are skipped")
            self.counts["skipped"] += late
            messages = messages[late:]
        for port, data in messages:
            for cycle in self._take(port, data):
                self._work(cycle)
                count += 1
        self._notice(count > 0)
        return count

    def _take(self, port: str, data: bytes) -> list[Any]:
        """Takes a message of one port, in bytes. Returns the cycles that it ends."""
        try:
            if port.startswith(_CAMERA):
                message = lcmt_image_array.decode(data)
                sent, size = 1e-6 * message.header.utime, [(image.width, image.height) for image in message.images]
            else:
                sent, size = 1e-3 * lcmt_drake_signal.decode(data).timestamp, None
        except Exception:  # whatever garbage makes of a decoder that somebody else generated
            self.counts["not_understood"] += 1
            return []
        if size is not None and size != [self._image_sizes[port]]:
            self._refuse(port, size)
        return self._collector.put(port, sent, (sent, data))

    def _refuse(self, port: str, size: list[tuple[int, int]]) -> NoReturn:
        came, known = (" and ".join(f"{w} x {h}" for w, h in sizes) for sizes in (size, [self._image_sizes[port]]))
        raise DrakeTrackerError(
            f"{channel_of(port)}: the image is {came or 'missing'}, this scenario's are {known} px; start host and arm "
            "with the same scenario and settings"
        )

    def _work(self, cycle: Any) -> None:
        if cycle.anew:
            self._begin(cycle.number)
        elif cycle.number > self._next:  # cycles of which nothing came
            self._say_frames({}, cycle.number - 1)
            self._simulator.AdvanceTo((cycle.number - 1) * VISION_PERIOD + self._done)
            self.counts["cycles_incomplete"] += cycle.number - self._next
        for port, (_, data) in cycle.messages.items():
            self._inside.Publish(channel_of(port), data)
        self._inside.HandleSubscriptions(0)
        self._say_frames(cycle.messages, cycle.number)
        self._simulator.AdvanceTo(cycle.number * VISION_PERIOD + self._done)
        self._next = cycle.number + 1
        self.counts["cycles"] += 1
        self.counts["cycles_incomplete"] += len(cycle.messages) < len(self._side.heard)
        packet = Prediction(self._side.GetOutputPort("prediction").Eval(self._simulator.get_context()))
        if packet.valid and packet.stamp != self._stamp:
            self.counts["packets"] += 1
            self._stamp = packet.stamp

    def _begin(self, number: int) -> None:
        """Starts afresh before the cycle ``number``."""
        context = self._side.CreateDefaultContext()
        context.SetTime((number - 0.5) * VISION_PERIOD)
        self._simulator.reset_context(context)
        self._say_frames({}, number)
        self._simulator.Initialize()
        if self.counts["laboratories"]:
            self._tell(f"the arm's clock stands at {number * VISION_PERIOD:.2f} s now: starting afresh")
        else:
            self._tell(f"hears the arm; its clock stands at {number * VISION_PERIOD:.2f} s")
        self.counts["laboratories"] += 1
        self._silent = False

    def _say_frames(self, messages: Mapping[str, Any], number: int) -> None:
        """Tells the vision which cameras have an image in the cycle ``number``, and when it was taken."""
        context = self._simulator.get_mutable_context()
        for port in self._image_sizes:
            sent = messages[port][0] if port in messages else number * VISION_PERIOD
            frame = self._side.GetInputPort(port.replace(_CAMERA, "frame_"))
            frame.FixValue(context, [sent, float(port in messages)])

    def _notice(self, heard: bool) -> None:
        now = self._clock()
        if heard:
            if self._silent:
                self._tell(f"hears the arm again, at {self.time:.2f} s")
            self._silent, self._last_heard = False, now
        elif self._last_heard is not None and not self._silent and now - self._last_heard > SILENCE:
            self._silent = True
            self._tell(f"the arm is silent since {self.time:.2f} s; waiting")
