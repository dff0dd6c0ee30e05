"""Adds a camera on the hand to a vision."""

from typing import NamedTuple

from pydrake.systems.framework import DiagramBuilder, OutputPort, System

from drake_tracker.core.timing import WRIST_SLOT, vision_slot
from drake_tracker.vision.hand.arm_silhouette import HandView
from drake_tracker.vision.hand.wrist_view import WristView
from drake_tracker.vision.hand.wrist_view_system import WristViewSystem


class WristParts(NamedTuple):
    """The inputs of a camera on the hand.

    Attributes:
        view: finds the object in its images.
        hand: the camera and the hand.
        held_width: opening of the jaws up to which they hold or have missed the object [m].
    """

    view: WristView
    hand: HandView
    held_width: float


def add_wrist_view(
    builder: DiagramBuilder,
    tracking: System,
    parts: WristParts,
    *,
    lag_cycles: int,
    image_latency: int,
    update_cycles: int,
    period: float,
    time_step: float,
    shares_arm: bool,
) -> dict[str, OutputPort]:
    """Adds a `WristViewSystem` behind a `TrackerSystem`, and exports its inputs.

    Args:
        builder: of the vision.
        tracking: the `TrackerSystem`.
        parts: the camera and what finds the object.
        lag_cycles: as for `WristViewSystem`.
        image_latency: as for `WristViewSystem`.
        update_cycles: as for `WristViewSystem`.
        period: of a cycle [s].
        time_step: the plant's step [s].
        shares_arm: whether the vision has the inputs ``arm_state`` and ``jaws`` already.

    Returns {name: output port} of the outputs that are added to the outputs of the tracker, or replace them.
    """
    system = builder.AddNamedSystem(
        "wrist_view",
        WristViewSystem(
            parts.view,
            parts.hand,
            held_width=parts.held_width,
            lag_cycles=lag_cycles,
            image_latency=image_latency,
            update_cycles=update_cycles,
            period=period,
            offset=vision_slot(WRIST_SLOT, time_step),
        ),
    )
    builder.Connect(tracking.GetOutputPort("tracks"), system.GetInputPort("tracks"))
    builder.Connect(tracking.GetOutputPort("point"), system.GetInputPort("fixed_point"))
    for name in ("camera_wrist", "prediction", "arm_state", "jaws"):
        port = system.GetInputPort(name)
        if shares_arm and name in ("arm_state", "jaws"):
            builder.ConnectInput(name, port)
        else:
            builder.ExportInput(port, name)
    return {name: system.GetOutputPort(name) for name in ("point", "tracks", "wrist")}
