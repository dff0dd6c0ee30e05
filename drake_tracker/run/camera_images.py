"""Keeps the images that the vision of a run reads, without loss, for replays from images."""

from collections.abc import Sequence
from pathlib import Path

import cv2
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, DiagramBuilder, LeafSystem
from pydrake.systems.sensors import ImageRgba8U

from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.diagrams.hand_eye import HandEyeDiagram, outputs
from drake_tracker.run.lossless_video import LosslessVideo

IMAGES_FOLDER = "images"
"""Folder of the images in a run directory."""


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
    is rendered twice. It is stored in grey, since the first step of the vision is the conversion to grey.

    Args:
        path: MKV file to write.
        size: (width, height) of the images [px].

    Attributes:
        video: the file.
    """

    def __init__(self, path: Path, size: tuple[int, int]) -> None:
        super().__init__()
        self.video = LosslessVideo(path, round(1.0 / VISION_PERIOD), size)
        self._image = self.DeclareAbstractInputPort("color_image", AbstractValue.Make(ImageRgba8U()))
        self.DeclarePeriodicPublishEvent(VISION_PERIOD, 0.0, self._write)

    def _write(self, context: Context) -> None:
        self.video.write(cv2.cvtColor(self._image.Eval(context).data, cv2.COLOR_RGBA2GRAY))


class CameraImageRecorder:
    """A `Recorder` that completes the files of images.

    Args:
        systems: the Systems that write the files.
    """

    def __init__(self, systems: Sequence[CameraImageSystem]) -> None:
        self._systems = systems

    def finish(self, root_context: Context) -> None:
        """Closes the files. The images were written during the run, so that the Context is not needed."""
        for system in self._systems:
            system.video.close()


def add_camera_images(builder: DiagramBuilder, *, hand_eye: HandEyeDiagram, folder: Path) -> CameraImageRecorder:
    """Adds a `CameraImageSystem` for each camera of a `HandEyeDiagram`.

    Args:
        builder: builder that contains ``hand_eye``.
        hand_eye: diagram whose images are kept.
        folder: run directory; the folder `IMAGES_FOLDER` is created in it.

    Returns the recorder.
    """
    (folder / IMAGES_FOLDER).mkdir()
    systems = []
    for port in outputs(hand_eye):
        if port.get_name().startswith("camera"):
            image = port.Allocate().get_value()
            system = CameraImageSystem(image_file(folder, port.get_name()), (image.width(), image.height()))
            builder.AddNamedSystem(f"{port.get_name()}_images", system)
            builder.Connect(port, system.get_input_port())
            systems.append(system)
    return CameraImageRecorder(systems)
