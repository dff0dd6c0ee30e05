"""Keeps the motion detector's intermediate images of one tracking instant, to be looked at after the run."""

from pydrake.common.value import AbstractValue
from pydrake.systems.framework import LeafSystem

from drake_tracker.core.messages import ArmCommand, message_size
from drake_tracker.grasp.schema import Phase
from drake_tracker.run.video_page import SIDES, port_of
from drake_tracker.tasks.train.figures import draw_motion_images

_PERIOD = 1.0


class MotionSnapshotSystem(LeafSystem):
    """Holds the newest intermediate images that were made in the best phase for it: while the hand tracked.

    .. pydrake_system::

        name: MotionSnapshotSystem
        input_ports:
        - motion_images_left
        - motion_images_right
        - command

    ``motion_images_*`` hold a `MotionImages` or None, ``command`` is an `ArmCommand`. The images, which cost time to
    make, are looked at once a period in these phases, and never else.

    Args:
      sides: of the ports' names; "" is a single camera, whose port is ``motion_images``.
      phases: those in which to look, later ones preferred. period: [s].
    """

    def __init__(self, sides=SIDES, phases=(Phase.TRACK,), period=_PERIOD):
        super().__init__()
        self._sides, self._phases = sides, phases
        self._images = {
            side: self.DeclareAbstractInputPort(port_of("motion_images", side), AbstractValue.Make(object()))
            for side in sides
        }
        self._command = self.DeclareVectorInputPort("command", message_size(ArmCommand))
        self._kept = self.DeclareAbstractState(AbstractValue.Make((-1, ())))
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._update)

    def kept(self, context):
        """Returns {side: images} of the instant kept, or None when there was none."""
        return dict(context.get_abstract_state(self._kept).get_value()[1]) or None

    def _update(self, context, state):
        phase = ArmCommand(self._command.Eval(context)).phase
        rank = self._phases.index(phase) if phase in self._phases else -1
        if rank < 0 or rank < context.get_abstract_state(self._kept).get_value()[0]:
            return
        images = tuple((side, self._images[side].Eval(context)) for side in self._sides)
        if all(each is not None for _, each in images):
            state.get_mutable_abstract_state(self._kept).set_value((rank, images))


class MotionSnapshotRecorder:
    """What `add_motion_snapshot` returns: `finish` draws the picture."""

    def __init__(self, system, path, draw):
        self._system, self._path, self._draw = system, path, draw

    def finish(self, root_context):
        """Draws the images kept in a Context of the whole diagram; leaves nothing when the hand never tracked."""
        images = self._system.kept(self._system.GetMyContextFromRoot(root_context))
        if images is not None:
            self._draw(images, self._path)


def add_motion_snapshot(builder, hand_eye, path, draw=draw_motion_images, **settings):
    """Adds a `MotionSnapshotSystem` to a `HandEyeDiagram`; its picture goes to the PNG file ``path``.

    Args:
      draw: ({side: images}, path) draws it. settings: of the System.

    Returns a `MotionSnapshotRecorder`.
    """
    system = builder.AddNamedSystem("motion_snapshot", MotionSnapshotSystem(**settings))
    for k in range(system.num_input_ports()):
        port = system.get_input_port(k)
        builder.Connect(hand_eye.GetOutputPort(port.get_name()), port)
    return MotionSnapshotRecorder(system, path, draw)
