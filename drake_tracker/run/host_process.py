"""The process of the host: receives messages of the sensors, and sends packets of predicted path."""

import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from pydrake.lcm import DrakeLcm
from pydrake.systems.analysis import Simulator

from drake_tracker.core.messages import Prediction
from drake_tracker.core.timing import SERVO_SLOT, VISION_PERIOD, vision_slot
from drake_tracker.estimation.point_check import refuse_point
from drake_tracker.network.channels import POINT, channel_of, new_identifier
from drake_tracker.network.cycles import (
    SILENCE,
    Cycle,
    CycleCollector,
    NotUnderstood,
    SenderLock,
    largest_message,
    read_image,
    read_vector,
)
from drake_tracker.network.mailbox import Mailbox
from drake_tracker.scenarios.base import BaseScenario
from drake_tracker.tasks.train.two_processes import make_host_side

_MOST_REPORTED = 20
"""Greatest number of different lines about messages that cannot be used."""
_CAMERA = "camera_"


class HostProcess:
    """Vision and estimator of the train, driven by messages.

    The host has no clock: the messages give the time. The messages of each cycle are published on a bus inside this
    process, and the diagram is advanced past the slots of that cycle. Its subscribers, which keep only the newest
    message, therefore miss no message, and the same points give the same packets as in a single process. When the time
    of the messages goes back, the sender has restarted, and the host restarts as well.

    Args:
        scenario: the scenario.
        incoming: connection on which messages of the sensors arrive.
        outgoing: connection on which packets are sent; not the same object as ``incoming`` if a thread listens there.
        tell: called with each line of news for the user.
        clock: returns the wall time [s].

    Attributes:
        mailbox: queue of the incoming messages.
        counts: {name: number of events} for the summary.

    Raises DrakeTrackerError when the scenario cannot be built, or when its task is not the train.
    """

    def __init__(
        self,
        scenario: BaseScenario,
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
        self._identifier = new_identifier()
        self._arm = SenderLock("arm", tell, clock)
        sizes = {port: largest_message(self._image_sizes.get(port)) for port in self._side.heard}
        self.mailbox = Mailbox(incoming, sizes)
        self._next = 0
        self._last_heard: float | None = None
        self._silent = False
        self._stamp: float | None = None
        self._reported: set[str] = set()
        names = ("laboratories", "cycles", "cycles_incomplete", "packets")
        self.counts = dict.fromkeys((*names, "not_understood", "points_refused", "skipped"), 0)

    @property
    def time(self) -> float:
        """The time up to which the host has advanced, on the sender's clock [s]."""
        return self._simulator.get_context().get_time()

    def step(self, timeout: float = 0.1) -> int:
        """Waits for messages and processes all that have arrived.

        Args:
            timeout: greatest wall time to wait [s].

        Returns the number of cycles that were processed.
        """
        count = 0
        messages = self.mailbox.collect(timeout)
        if self.mailbox.skipped and not self.counts["skipped"]:
            self._tell("slower than the arm: skipping the oldest messages")
        self.counts["skipped"] = self.mailbox.skipped
        for port, data in messages:
            for cycle in self._take(port, data):
                self._work(cycle)
                count += 1
        self._notice(count > 0)
        return count

    def _take(self, port: str, data: bytes) -> list[Cycle]:
        """Adds an encoded message of one port. Returns the cycles that it completes."""
        try:
            if port in self._image_sizes:
                sent, data, run = read_image(data, self._image_sizes[port])
            else:
                sent, values, run = read_vector(data, self._side.fields[port])
                trouble = refuse_point(values, sent, VISION_PERIOD) if port in POINT else None
                if port not in POINT and not np.isfinite(values).all():
                    raise NotUnderstood("it has a number that is not finite")
                if trouble:
                    self.counts["points_refused"] += 1
                    self._report(f"{channel_of(port)}: ignoring a point: {trouble}")
        except NotUnderstood as error:
            self.counts["not_understood"] += 1
            self._report(f"{channel_of(port)}: ignoring a message: {error}")
            return []
        known = self._arm.sender
        if not self._arm.accepts(run):
            return []
        if known not in (None, run):  # the next cycle is the first one of another run
            self._collector = CycleCollector(self._side.heard, VISION_PERIOD)
        return self._collector.put(port, sent, (sent, data))

    def _report(self, line: str) -> None:
        """Tells the user a line, unless it was told before."""
        if line not in self._reported and len(self._reported) < _MOST_REPORTED:
            self._reported.add(line)
            self._tell(line)

    def _work(self, cycle: Cycle) -> None:
        if cycle.anew:
            self._begin(cycle.number)
        elif cycle.number > self._next:  # cycles without any message
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
        """Restarts the host before the cycle with a given number."""
        context = self._side.CreateDefaultContext()
        context.SetTime((number - 0.5) * VISION_PERIOD)
        self._side.GetInputPort("sender").FixValue(context, [self._arm.sender or 0.0, self._identifier])
        self._simulator.reset_context(context)
        self._say_frames({}, number)
        self._simulator.Initialize()
        if self.counts["laboratories"]:
            way = "went back" if number < self._next else "jumped ahead"
            self._tell(f"the arm's clock {way} to {number * VISION_PERIOD:.2f} s: restarting")
        else:
            self._tell(f"receiving from the arm; its clock is at {number * VISION_PERIOD:.2f} s")
        self.counts["laboratories"] += 1
        self._silent = False

    def _say_frames(self, messages: Mapping[str, Any], number: int) -> None:
        """Sets which cameras have an image in a cycle, and its capture time.

        Without the state of the arm, where vision needs it, the images of a cycle are not used.

        Args:
            messages: {port: (time sent [s], data)} of the cycle.
            number: number of the cycle.
        """
        context = self._simulator.get_mutable_context()
        complete = self._side.fields.keys() <= messages.keys()
        for port in self._image_sizes:
            sent = messages[port][0] if port in messages else number * VISION_PERIOD
            frame = self._side.GetInputPort(port.replace(_CAMERA, "frame_"))
            frame.FixValue(context, [sent, float(port in messages and complete)])

    def _notice(self, heard: bool) -> None:
        now = self._clock()
        if heard:
            if self._silent:
                self._tell(f"receiving from the arm again, at {self.time:.2f} s")
            self._silent, self._last_heard = False, now
        elif self._last_heard is not None and not self._silent and now - self._last_heard > SILENCE:
            self._silent = True
            self._tell(f"the arm has been silent since {self.time:.2f} s; waiting")
