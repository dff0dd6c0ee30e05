"""Records a run as an MCAP file: the images during the run, everything else from its log at the end."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, DiagramBuilder, LeafSystem
from pydrake.systems.primitives import VectorLogSink
from pydrake.systems.sensors import ImageRgba8U

from drake_tracker.core.files.mcap_file import McapFile
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.diagrams.hand_eye import HandEyeDiagram, has_images
from drake_tracker.run.log_recorder import read_log, tool_signal
from drake_tracker.run.mcap_signals import write_signals
from drake_tracker.tasks.filming import FRAMES_PER_SECOND, Film, port_of
from drake_tracker.tasks.task import Task

MCAP_FILE = "run.mcap"
"""Name of the file in a run directory."""


class McapImageSystem(LeafSystem):
    """Writes the images of one camera to an MCAP file, 30 in each second.

    .. pydrake_system::

        name: McapImageSystem
        input_ports:
        - color_image

    ``color_image`` is an `ImageRgba8U`, read at instants at which the vision reads it too, so that no image is rendered
    twice. Its time in the file is its capture time.

    Args:
        file: file to write to.
        side: suffix of the camera's ports.
        every: number of vision cycles from one image to the next.
        latency: number of cycles from the capture of an image until the port shows it.
    """

    def __init__(self, file: McapFile, side: str, every: int, latency: int) -> None:
        super().__init__()
        self._file, self._latency = file, latency
        self._frame = port_of("camera", side)
        self._image = self.DeclareAbstractInputPort("color_image", AbstractValue.Make(ImageRgba8U()))
        offset = (latency % every) * VISION_PERIOD
        self.DeclarePeriodicPublishEvent(every * VISION_PERIOD, offset, self._write)

    def _write(self, context: Context) -> None:
        captured = context.get_time() - self._latency * VISION_PERIOD
        if captured > -0.5 * VISION_PERIOD:
            self._file.image(f"/{self._frame}/image", captured, self._frame, self._image.Eval(context).data)


class McapRecorder:
    """A `Recorder` that completes the MCAP file of a run.

    Args:
        file: the file.
        hand_eye: diagram of the run.
        loggers: the return value of `add_loggers`.
        task: task of the run.
    """

    def __init__(
        self, file: McapFile, hand_eye: HandEyeDiagram, loggers: Mapping[str, VectorLogSink], task: Task
    ) -> None:
        self._file, self._hand_eye, self._loggers, self._task = file, hand_eye, loggers, task

    def finish(self, root_context: Context) -> None:
        """Writes the signals of the run and closes the file."""
        model = self._hand_eye.arm.model
        try:
            log = read_log(self._loggers, root_context, self._task)
            log["tool"] = tool_signal(log["arm_state"], model)
            write_signals(self._file, log, self._task.phases, model)
        finally:
            self._file.close()


def add_mcap_recording(
    builder: DiagramBuilder,
    *,
    hand_eye: HandEyeDiagram,
    loggers: Mapping[str, VectorLogSink],
    film: Film | None,
    task: Task,
    folder: Path,
) -> McapRecorder:
    """Adds the Systems that record a run as the file `MCAP_FILE`: one `McapImageSystem` for each camera, if there are
    cameras.

    Args:
        builder: builder that contains ``hand_eye``.
        hand_eye: diagram to record.
        loggers: the return value of `add_loggers`.
        film: cameras of the run; None without images.
        task: task of the run.
        folder: run directory.

    Returns the recorder. Raises DrakeTrackerError when the extra ``mcap`` is not installed or the file cannot be
    written.
    """
    file = McapFile(folder / MCAP_FILE)
    if film is not None and has_images(hand_eye):
        every = max(film.every, round(1.0 / (FRAMES_PER_SECOND * VISION_PERIOD)))
        for side, camera in film.cameras.items():
            name = port_of("camera", side)
            port = hand_eye.GetOutputPort(name)
            image = port.Allocate().get_value()
            u, v = film.offsets[side]
            K = camera.K - np.array([[0.0, 0.0, u], [0.0, 0.0, v], [0.0, 0.0, 0.0]])
            file.calibration(f"/{name}/calibration", 0.0, name, (image.width(), image.height()), K, camera.distortion)
            file.transforms("/tf", 0.0, {name: camera.X_WC})
            system = McapImageSystem(file, side, every, film.image_latency)
            builder.AddNamedSystem(f"{name}_mcap", system)
            builder.Connect(port, system.get_input_port())
    return McapRecorder(file, hand_eye, loggers, task)
