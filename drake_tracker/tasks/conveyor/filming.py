"""What the video and the 3-D recording of a run of the conveyor show."""

from enum import IntEnum
from typing import Any

import numpy as np

from drake_tracker.core.messages import PickDiagnosis, predicted_points
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.diagrams.hand_eye import HandEyeDiagram
from drake_tracker.grasp.conveyor.pick_schema import PickPhase
from drake_tracker.tasks.conveyor.scenario import Rendered
from drake_tracker.tasks.conveyor.setup import ConveyorSetup
from drake_tracker.tasks.filming import FRAMES_PER_SECOND, PATH_MARKS, Film, Script, View
from drake_tracker.vision.parts.part_vision_diagram import belt_window

PREDICTING = (PickPhase.TRACK, PickPhase.INTERCEPT, PickPhase.CLOSE)
"""Phases in which the predicted path of the part is drawn."""
AHEAD = 1.0
"""Time for which it is drawn [s]."""


def predicted_path(packet: np.ndarray, now: float) -> np.ndarray:
    """Returns points of the predicted path of a part in W [m], shape (PATH_MARKS, 3).

    Args:
        packet: vector of a valid `Prediction`.
        now: present time [s].
    """
    return predicted_points(packet, np.linspace(now, now + AHEAD, PATH_MARKS))


def pick_notes(phase: IntEnum, diagnosis: Any) -> tuple[str, str]:
    """Returns two notes for a frame of the video: how many parts were placed, and how many picks failed.

    Args:
        phase: the present phase.
        diagnosis: a `PickDiagnosis`.
    """
    placed, failed = int(diagnosis.placed), int(diagnosis.failed)
    return f"{placed} placed", f"{failed} failed" if failed else ""


CONVEYOR_SCRIPT = Script(
    phases=PickPhase, predicting=PREDICTING, diagnosis=PickDiagnosis, notes=pick_notes, path=predicted_path
)
CONVEYOR_VIEW = View(
    phases=PREDICTING, path=predicted_path, eye=(1.75, -1.05, 1.55), target=(0.42, 0.02, 0.48), fov_deg=40.0
)


def conveyor_film(setup: ConveyorSetup, hand_eye: HandEyeDiagram) -> Film:
    """Returns what the camera video of a run of the conveyor shows.

    Args:
        setup: of a scenario with ``vision: !Rendered``.
        hand_eye: the diagram of the run.
    """
    config, cameras, belt = setup.scenario.cameras, setup.cameras, setup.seen_belt
    vision, height = setup.scenario.vision, setup.scenario.belt.height
    return Film(
        title=setup.scenario.name,
        subtitle=f"seed {setup.scenario.seed}, {setup.scenario.belt.speed:g} m/s",
        polygons={side: belt_window(camera, belt, height).polygon for side, camera in cameras.items()},
        image_size=(config.width, config.height),
        cameras=cameras,
        offsets={side: hand_eye.world.cameras[f"camera_{side}"].window[:2] for side in cameras},
        lag=setup.scenario.vision.lag_cycles * VISION_PERIOD,
        lag_cycles=setup.scenario.vision.lag_cycles,
        every=round(1.0 / (FRAMES_PER_SECOND * VISION_PERIOD)),
        update_cycles=vision.update_cycles if isinstance(vision, Rendered) else 1,
        script=CONVEYOR_SCRIPT,
        image_latency=hand_eye.world.image_latency,
        several=True,
    )
