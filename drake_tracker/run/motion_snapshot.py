"""Keeps the intermediate images of the motion detector at one instant, for a picture that is drawn after the run."""

from collections.abc import Callable
from enum import IntEnum
from pathlib import Path
from typing import Any

from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, DiagramBuilder, LeafSystem, State

from drake_tracker.core.messages import ArmCommand, message_size
from drake_tracker.diagrams.hand_eye import HandEyeDiagram, inputs
from drake_tracker.tasks.filming import Snapshot, port_of


class MotionSnapshotSystem(LeafSystem):
    """Keeps the newest intermediate images from the preferred phase that was reached.

    .. pydrake_system::

        name: MotionSnapshotSystem
        input_ports:
        - motion_images_left
        - motion_images_right
        - command

    These are the ports for two cameras. A single camera has ``motion_images``.

    - ``motion_images_*``: the intermediate images of the detector, or None while there are none.
    - ``command``: an `ArmCommand`. All zeros is its first phase.

    The images take time to compute. They are evaluated once per period, with offset 0, and only in the given phases.

    Args:
        sides: suffixes of the ports; the suffix of a single camera is empty.
        phases: phases in which images are kept; later ones in this tuple are preferred.
        period: time between two evaluations [s].
    """

    def __init__(self, sides: tuple[str, ...], phases: tuple[IntEnum, ...], period: float) -> None:
        super().__init__()
        self._sides, self._phases = sides, phases
        self._images = {
            side: self.DeclareAbstractInputPort(port_of("motion_images", side), AbstractValue.Make(object()))
            for side in sides
        }
        self._command = self.DeclareVectorInputPort("command", message_size(ArmCommand))
        self._kept = self.DeclareAbstractState(AbstractValue.Make((-1, ())))
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._update)

    def kept(self, context: Context) -> dict[str, Any] | None:
        """Returns {side: images} of the instant that was kept, or None when there are none."""
        return dict(context.get_abstract_state(self._kept).get_value()[1]) or None

    def _update(self, context: Context, state: State) -> None:
        phase = ArmCommand(self._command.Eval(context)).phase
        rank = self._phases.index(phase) if phase in self._phases else -1
        if rank < 0 or rank < context.get_abstract_state(self._kept).get_value()[0]:
            return
        images = tuple((side, self._images[side].Eval(context)) for side in self._sides)
        if all(each is not None for _, each in images):
            state.get_mutable_abstract_state(self._kept).set_value((rank, images))


class MotionSnapshotRecorder:
    """A `Recorder` that draws the picture of the motion detector.

    Args:
        system: the System that keeps the images.
        path: PNG file to write.
        draw: ({side: images}, path) -> None, draws the picture.
    """

    def __init__(self, system: MotionSnapshotSystem, path: Path, draw: Callable[[dict[str, Any], Path], None]) -> None:
        self._system, self._path, self._draw = system, path, draw

    def finish(self, root_context: Context) -> None:
        """Draws the images that were kept. Writes no file when there are none."""
        images = self._system.kept(self._system.GetMyContextFromRoot(root_context))
        if images is not None:
            self._draw(images, self._path)


def add_motion_snapshot(
    builder: DiagramBuilder, *, hand_eye: HandEyeDiagram, snapshot: Snapshot, path: Path
) -> MotionSnapshotRecorder:
    """Adds a `MotionSnapshotSystem` to the builder of a `HandEyeDiagram`.

    Args:
        builder: builder that contains ``hand_eye``.
        hand_eye: diagram whose images are kept.
        snapshot: when to keep images, and how to draw them.
        path: PNG file to write at the end.

    Returns the recorder.
    """
    system = MotionSnapshotSystem(sides=snapshot.sides, phases=snapshot.phases, period=snapshot.period)
    builder.AddNamedSystem("motion_snapshot", system)
    for port in inputs(system):
        builder.Connect(hand_eye.GetOutputPort(port.get_name()), port)
    return MotionSnapshotRecorder(system, path, snapshot.draw)
