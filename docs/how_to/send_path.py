"""Publishes the predicted path of a tracked object over LCM, for the guide "Use other cameras"."""

from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from drake_tracker.core.messages import Prediction
from drake_tracker.network.channels import Vector
from drake_tracker.network.signal_system import add_sender
from drake_tracker.own_cameras import prepare_track


def send_path(sources, lcm, duration, **options):
    """Tracks for a while [s] and publishes each predicted path on DRAKE_TRACKER_PREDICTION."""
    if not options.get("calibration"):
        raise ValueError("an arm needs a path in metres, and without a calibration it is in pixels")
    tracking = prepare_track(sources, **options)
    period = tracking.timeline.period
    builder = DiagramBuilder()
    tracker = builder.AddSystem(tracking.diagram)
    vector = Vector(Prediction.get_fields(), period, 0.5 * period)
    sender = add_sender(builder, lcm=lcm, port="prediction", vector=vector)
    builder.Connect(tracker.GetOutputPort("prediction"), sender)
    try:
        Simulator(builder.Build()).AdvanceTo(duration)
    finally:
        for footage in tracking.footage:
            footage.close()
