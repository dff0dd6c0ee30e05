"""Synthetic footage: two cameras that look at a bright ball on a known circle."""

from fractions import Fraction

import av
import cv2
import numpy as np

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.cameras.files.calibration_file import save_calibration

WIDTH, HEIGHT, FOCUS = 320, 240, 420.0
RADIUS, BALL = 0.12, 0.025
"""Of the circle and of the ball [m]."""
CENTRE = np.array([0.0, 0.0, 0.06])
TURN_TIME = 4.0
"""Time of a lap [s]."""
TILT = 0.3
"""Of the circle's plane about x [rad]."""


def look_at(eye, at=CENTRE):
    """X_CW of a camera at ``eye`` [m] whose axis goes through ``at``, its u axis level."""
    z = (at - eye) / np.linalg.norm(at - eye)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    R = np.array([x, np.cross(z, x), z])
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = R, -R @ eye
    return X


def make_camera(eye):
    K = [[FOCUS, 0.0, (WIDTH - 1) / 2], [0.0, FOCUS, (HEIGHT - 1) / 2], [0.0, 0.0, 1.0]]
    return CameraModel(K, np.zeros(5), look_at(np.array(eye)), WIDTH, HEIGHT)


CAMERAS = {"camera_left": make_camera([0.5, -0.5, 0.45]), "camera_right": make_camera([-0.5, -0.5, 0.45])}


def on_circle(time, tilt=TILT):
    """p_WQ (3,) [m] of the ball's centre at ``time`` [s]."""
    angle = 2.0 * np.pi * np.asarray(time) / TURN_TIME
    x, y = RADIUS * np.cos(angle), RADIUS * np.sin(angle)
    return CENTRE + np.stack([x, y * np.cos(tilt), y * np.sin(tilt)], axis=-1)


def draw(camera, p_WQ, rng=None):
    """The grey image of the ball."""
    image = np.full((HEIGHT, WIDTH), 50.0)
    u, v = camera.project(p_WQ)[0]
    depth = (camera.X_CW @ [*p_WQ, 1.0])[2]
    columns, rows = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    distance = np.hypot(columns - u, rows - v)
    image += 150.0 * np.clip(FOCUS * BALL / depth + 0.5 - distance, 0.0, 1.0)
    if rng is not None:
        image += rng.normal(0.0, 1.5, image.shape)
    return np.rint(np.clip(image, 0, 255)).astype(np.uint8)


def film(side, times, path=on_circle):
    rng = np.random.default_rng(len(side))
    return [draw(CAMERAS[f"camera_{side}"], path(time), rng) for time in times]


def write_images(folder, images, numbers=None):
    """Writes a folder of images, their names numbered; returns its path as text."""
    folder.mkdir()
    for number, image in zip(range(len(images)) if numbers is None else numbers, images):
        assert cv2.imwrite(str(folder / f"image{number:05d}.png"), image)
    return str(folder)


def write_video(path, images, times, rate=30):
    """Writes a video whose frames have the given times [s], to a millisecond; returns its path as text."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=rate, options={"preset": "ultrafast", "crf": "10"})
        stream.width, stream.height, stream.pix_fmt = images[0].shape[1], images[0].shape[0], "yuv420p"
        stream.codec_context.time_base = stream.time_base = Fraction(1, 1000)
        stream.codec_context.thread_count = 1
        for image, time in zip(images, times):
            frame = av.VideoFrame.from_ndarray(cv2.cvtColor(image, cv2.COLOR_GRAY2RGB), format="rgb24")
            frame.pts, frame.time_base = round(1000 * time), stream.codec_context.time_base
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return str(path)


def write_calibration(path, cameras=CAMERAS):
    """Writes a calibration file whose board plane is z = 0; returns its path as text."""
    save_calibration(path, cameras, notes={"X_WP": np.eye(4).tolist()})
    return str(path)


def read_track(folder):
    """Returns {column: (n,)} of a track.csv, NaN where it is empty."""
    table = np.genfromtxt(folder / "track.csv", delimiter=",", names=True)
    return {name: np.atleast_1d(table[name]) for name in table.dtype.names}
