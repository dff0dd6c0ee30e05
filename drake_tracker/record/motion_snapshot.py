"""Keeps the motion detector's intermediate images of one tracking instant, to be looked at after the run."""

from pydrake.common.value import AbstractValue
from pydrake.systems.framework import LeafSystem

from drake_tracker.grasp.schema import Phase
from drake_tracker.messages import ArmCommand, message_size
from drake_tracker.record.figures import draw_motion_images

SIDES = ("left", "right")
_PERIOD = 1.0


class MotionSnapshotSystem(LeafSystem):
    """Holds the newest intermediate images that were made while the hand tracked.

    .. pydrake_system::

        name: MotionSnapshotSystem
        input_ports:
        - motion_images_left
        - motion_images_right
        - command

    ``motion_images_*`` hold a `MotionImages` or None, ``command`` is an `ArmCommand`. The images, which cost time to
    make, are looked at once a second while tracking, and never else.
    """

    def __init__(self):
        super().__init__()
        self._images = {
            side: self.DeclareAbstractInputPort(f"motion_images_{side}", AbstractValue.Make(object())) for side in SIDES
        }
        self._command = self.DeclareVectorInputPort("command", message_size(ArmCommand))
        self._kept = self.DeclareAbstractState(AbstractValue.Make(()))
        self.DeclarePeriodicUnrestrictedUpdateEvent(_PERIOD, 0.0, self._update)

    def kept(self, context):
        """Returns {side: MotionImages} of the newest tracking instant, or None when there was none."""
        return dict(context.get_abstract_state(self._kept).get_value()) or None

    def _update(self, context, state):
        if ArmCommand(self._command.Eval(context)).phase != Phase.TRACK:
            return
        images = tuple((side, self._images[side].Eval(context)) for side in SIDES)
        if all(each is not None for _, each in images):
            state.get_mutable_abstract_state(self._kept).set_value(images)


class MotionSnapshotRecorder:
    """What `add_motion_snapshot` returns: `finish` draws the picture."""

    def __init__(self, system, path):
        self._system, self._path = system, path

    def finish(self, root_context):
        """Draws the images kept in a Context of the whole diagram; leaves nothing when the hand never tracked."""
        images = self._system.kept(self._system.GetMyContextFromRoot(root_context))
        if images is not None:
            draw_motion_images(images, self._path)


def add_motion_snapshot(builder, hand_eye, path):
    """Adds a `MotionSnapshotSystem` to a `HandEyeDiagram`; its picture goes to the PNG file ``path``.

    Returns a `MotionSnapshotRecorder`.
    """
    system = builder.AddNamedSystem("motion_snapshot", MotionSnapshotSystem())
    for port in (*(f"motion_images_{side}" for side in SIDES), "command"):
        builder.Connect(hand_eye.GetOutputPort(port), system.GetInputPort(port))
    return MotionSnapshotRecorder(system, path)
