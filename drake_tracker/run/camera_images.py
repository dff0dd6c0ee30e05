"""Keeps the images that the vision of a run reads, to the last bit, so that it can be run again without a world."""

import cv2
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import LeafSystem
from pydrake.systems.sensors import ImageRgba8U

from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.diagrams.hand_eye import outputs
from drake_tracker.run.lossless_video import LosslessVideo

IMAGES_FOLDER = "images"


def image_file(run_directory, camera):
    """Returns the path of the file with a camera's images in the directory of a run."""
    return run_directory / IMAGES_FOLDER / f"{camera}.mkv"


class CameraImageSystem(LeafSystem):
    """Writes the images of one camera to a file, one a cycle.

    .. pydrake_system::

        name: CameraImageSystem
        input_ports:
        - color_image

    ``color_image`` is an ImageRgba8U, published at the vision's instants, so that no image is rendered twice. It is
    kept in grey, which is what the vision makes of it first.

    Args:
      path: MKV file to write. size: (width, height) [px].
    """

    def __init__(self, path, size):
        super().__init__()
        self.video = LosslessVideo(path, round(1.0 / VISION_PERIOD), size)
        self._image = self.DeclareAbstractInputPort("color_image", AbstractValue.Make(ImageRgba8U()))
        self.DeclarePeriodicPublishEvent(VISION_PERIOD, 0.0, self._write)

    def _write(self, context):
        self.video.write(cv2.cvtColor(self._image.Eval(context).data, cv2.COLOR_RGBA2GRAY))


class CameraImageRecorder:
    """What `add_camera_images` returns: `finish` ends the files."""

    def __init__(self, systems):
        self._systems = systems

    def finish(self, root_context):
        """Ends the files. The Context is not needed: everything has been written as it came."""
        for system in self._systems:
            system.video.close()


def add_camera_images(builder, hand_eye, folder):
    """Adds a `CameraImageSystem` for each camera of a `HandEyeDiagram`; the files go to the run directory ``folder``.

    Returns a `CameraImageRecorder`.
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
