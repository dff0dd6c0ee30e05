"""A laboratory without a renderer, shared by tests of several rooms: two small cameras and a film that they see.

The tests render in their own process, because there are as many of them as processors. To run them with processes that
render: ``DRAKE_TRACKER_RENDER_PROCESSES=2 pytest``.
"""

import fcntl
import os
from functools import partial

import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import LeafSystem
from pydrake.systems.sensors import ImageRgba8U

from drake_tracker.vision.region_of_interest import project_region
from drake_tracker.world.config import CamerasConfig
from drake_tracker.world.imaging.cameras import true_camera_models

pytest_plugins = ["made_up_run"]

os.environ.setdefault("DRAKE_TRACKER_RENDER_PROCESSES", "0")

SIZE = 160
WORK_VOLUME = [[0.33, -0.30, 0.45], [0.79, 0.30, 0.505]]


class Film(LeafSystem):
    """What two cameras see of a bright body on a path: a rectangle about its centre's image, at every instant.

    ``path`` is a function of the time [s] that returns p_WQ [m], or None while there is nothing to see.
    """

    def __init__(self, cameras, windows, path):
        super().__init__()
        self.set_name("film")
        for side in ("left", "right"):
            u0, v0, width, height = windows[side]
            columns, rows = np.meshgrid(u0 + np.arange(width), v0 + np.arange(height))
            self.DeclareAbstractOutputPort(
                f"camera_{side}",
                partial(AbstractValue.Make, ImageRgba8U(width, height)),
                partial(self._draw, path, cameras[side], columns, rows),
            )

    @staticmethod
    def _draw(path, camera, columns, rows, context, output):
        grey = np.full(rows.shape, 40.0)
        p_WQ = path(context.get_time())
        if p_WQ is not None:
            u, v = camera.project(p_WQ)[0]
            grey += 130.0 * np.clip(12.5 - abs(columns - u), 0, 1) * np.clip(7.5 - abs(rows - v), 0, 1)
        output.get_mutable_value().mutable_data[:] = np.rint(grey)[..., None]


class SmallLaboratory:
    """Two cameras of 160 x 160 px where the real ones stand, and a train that runs in a circle."""

    speed = 0.15
    radius = 0.12
    work_volume = WORK_VOLUME

    def __init__(self):
        models = true_camera_models(CamerasConfig(width=SIZE, height=SIZE))
        self.cameras = {side: models[f"camera_{side}"] for side in ("left", "right")}
        self.windows = {side: project_region(self.cameras[side], WORK_VOLUME, "ellipse") for side in self.cameras}
        self.whole = dict.fromkeys(self.cameras, (0, 0, SIZE, SIZE))

    def circle(self, time):
        """p_WQ [m] of the train at ``time`` [s]."""
        angle = self.speed / self.radius * np.asarray(time)
        x, y = 0.56 + self.radius * np.cos(angle), self.radius * np.sin(angle)
        return np.stack([x, y, np.full_like(x, 0.485)], axis=-1)

    def film(self, path=None, windows=None):
        return Film(self.cameras, windows or self.whole, path or self.circle)


@pytest.fixture(scope="session")
def small_laboratory():
    return SmallLaboratory()


@pytest.fixture(scope="session")
def record_once(tmp_path_factory):
    """Returns the folder of a run that only the first process records, of those between which pytest-xdist divides
    the tests: ``record_once(name, record)``, where ``record(folder)`` writes the run. The tests only read it."""
    shared = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        shared = shared.parent

    def folder_of(name, record):
        folder, done = shared / name / "run", shared / name / "recorded"
        folder.parent.mkdir(exist_ok=True)
        with open(shared / f"{name}.lock", "w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not done.exists():
                record(folder)
                done.touch()
        return folder

    return folder_of
