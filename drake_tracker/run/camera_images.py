"""Keeps the images that the vision of a run reads, without loss, for replays from images."""

import math
from collections.abc import Sequence
from pathlib import Path

import cv2
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, DiagramBuilder, LeafSystem
from pydrake.systems.sensors import ImageRgba8U

from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.diagrams.hand_eye import HandEyeDiagram, has_tracks, outputs
from drake_tracker.footage.encoded_video import LosslessVideo

IMAGES_FOLDER = "images"
"""Folder of the images in a run directory."""
_ROUNDING = 1e-6
"""Allowance for rounding errors of times [cycles]."""


def image_file(run_directory: Path, camera: str) -> Path:
    """Returns the path of the file with the images of a camera.

    Args:
        run_directory: directory of the run.
        camera: name of the camera.
    """
    return run_directory / IMAGES_FOLDER / f"{camera}.mkv"


class CameraImageSystem(LeafSystem):
    """Writes the images of one camera to a file, one in each vision cycle.

    .. pydrake_system::

        name: CameraImageSystem
        input_ports:
        - color_image

    - ``color_image``: an ImageRgba8U.

    The image is written every 1/60 s with offset 0. The vision reads the camera at the same instants, so that no image
    is rendered twice. It is stored in grey where the first step of the vision is the conversion to grey. If images
    appear ``latency`` cycles after their capture, `write_rest` writes the last ones after the end.

    Args:
        path: MKV file to write.
        size: (width, height) of the images [px].
        latency: cycles from the capture of an image until the input shows it.
        colour: whether the images are stored in colour.

    Attributes:
        video: the file.
    """

    def __init__(self, path: Path, size: tuple[int, int], latency: int = 0, colour: bool = False) -> None:
        super().__init__()
        self._latency, self._written = latency, 0
        self._colour = colour
        self.video = LosslessVideo(path, round(1.0 / VISION_PERIOD), size, colour)
        self._image = self.DeclareAbstractInputPort("color_image", AbstractValue.Make(ImageRgba8U()))
        self.DeclarePeriodicPublishEvent(VISION_PERIOD, 0.0, self._write)

    def write_rest(self, root_context: Context) -> None:
        """Writes the images that were captured before the end but have not appeared.

        Args:
            root_context: of the whole diagram, at the end; it is not changed.
        """
        if self._latency > 0:
            later = root_context.Clone()
            context = self.GetMyContextFromRoot(later)
            captured = math.ceil(root_context.get_time() / VISION_PERIOD - _ROUNDING)
            for cycle in range(self._written, captured):
                later.SetTime((cycle + self._latency) * VISION_PERIOD)
                self._write(context)

    def _write(self, context: Context) -> None:
        if round(context.get_time() / VISION_PERIOD) >= self._latency:
            image = self._image.Eval(context).data
            self.video.write(image if self._colour else cv2.cvtColor(image, cv2.COLOR_RGBA2GRAY))
            self._written += 1


class CameraImageRecorder:
    """A `Recorder` that completes the files of images.

    Args:
        systems: the Systems that write the files.
    """

    def __init__(self, systems: Sequence[CameraImageSystem]) -> None:
        self._systems = systems

    def finish(self, root_context: Context) -> None:
        """Writes the images that are left, and closes the files."""
        for system in self._systems:
            try:
                system.write_rest(root_context)
            finally:
                system.video.close()


def add_camera_images(builder: DiagramBuilder, *, hand_eye: HandEyeDiagram, folder: Path) -> CameraImageRecorder:
    """Adds a `CameraImageSystem` for each camera of a `HandEyeDiagram`, in colour if its vision tracks several objects.

    Args:
        builder: builder that contains ``hand_eye``.
        hand_eye: diagram whose images are kept.
        folder: run directory; the folder `IMAGES_FOLDER` is created in it.

    Returns the recorder.
    """
    (folder / IMAGES_FOLDER).mkdir()
    systems, latency = [], hand_eye.world.image_latency
    for port in outputs(hand_eye):
        if port.get_name().startswith("camera"):
            image = port.Allocate().get_value()
            file, size = image_file(folder, port.get_name()), (image.width(), image.height())
            system = CameraImageSystem(file, size, latency, has_tracks(hand_eye))
            builder.AddNamedSystem(f"{port.get_name()}_images", system)
            builder.Connect(port, system.get_input_port())
            systems.append(system)
    return CameraImageRecorder(systems)
