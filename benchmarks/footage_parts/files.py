"""`drake-tracker track` on the same clip in different files, for `footage.py`: what a container, a codec, a rate or a
rotation changes in the track."""

import tempfile
from fractions import Fraction
from pathlib import Path
from typing import NamedTuple

import av
import cv2
import numpy as np
from footage_parts.clips import RATE, make_clip

from drake_tracker.own_cameras import make_track, prepare_track

IMAGES = 60
X264 = {"crf": "20"}


class File(NamedTuple):
    """How a clip is written.

    Attributes:
        suffix: of the file.
        codec: of FFmpeg.
        options: of the codec.
        pixels: format of the pixels.
        rotation: by which a player turns the images [deg].
        dropped: images that are left out.
        jitter: standard deviation of the time stamps [s].
        damaged: whether a part of the file is overwritten.
    """

    suffix: str
    codec: str
    options: dict
    pixels: str = "yuv420p"
    rotation: int = 0
    dropped: tuple = ()
    jitter: float = 0.0
    damaged: bool = False


FILES = {
    "H.264 in MP4": File("mp4", "libx264", X264),
    "H.264 in MOV": File("mov", "libx264", X264),
    "H.264 in AVI, B-frames": File("avi", "libx264", X264),
    "H.264 in MKV": File("mkv", "libx264", X264),
    "H.265 in MP4": File("mp4", "libx265", {"x265-params": "crf=20:log-level=none"}),
    "MPEG-4 in AVI, B-frames": File("avi", "mpeg4", {"bf": "2", "b": "4000000"}),
    "Motion JPEG in AVI": File("avi", "mjpeg", {"b": "20000000"}, "yuvj420p"),
    "VP9 in WebM": File("webm", "libvpx-vp9", {"b": "3000000", "deadline": "realtime", "cpu-used": "8"}),
    "FFV1 in MKV": File("mkv", "ffv1", {}),
    "turned by 90°": File("mp4", "libx264", X264, rotation=90),
    "turned by 180°": File("mp4", "libx264", X264, rotation=180),
    "turned by 270°": File("mov", "libx264", X264, rotation=270),
    "4 images dropped": File("mp4", "libx264", X264, dropped=(20, 21, 35, 44)),
    "stamps with 3 ms of jitter": File("mkv", "libx264", X264, jitter=0.003),
}


def write(path, file, images, rng):
    """Writes grey images as a video."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream(file.codec, rate=round(RATE), options=file.options)
        turned = [np.ascontiguousarray(np.rot90(image, -file.rotation // 90)) for image in images]
        stream.height, stream.width = turned[0].shape
        stream.pix_fmt = file.pixels
        stream.codec_context.thread_count = 1
        fine = Fraction(1, 1000) if file.jitter else Fraction(1, round(RATE))
        stream.codec_context.time_base = stream.time_base = fine
        if file.rotation:
            stream.set_display_rotation(file.rotation)
        for k, image in enumerate(turned):
            late = float(rng.normal(0.0, file.jitter)) if file.jitter else 0.0
            if k in file.dropped:
                continue
            frame = av.VideoFrame.from_ndarray(cv2.cvtColor(image, cv2.COLOR_GRAY2RGB), format="rgb24")
            frame = frame.reformat(format=file.pixels)
            frame.pts, frame.time_base = max(0, round((k / RATE + late) / fine)), fine
            container.mux(stream.encode(frame))
        container.mux(stream.encode())


def track(source, folder, **options):
    """Returns (columns of the track, summary)."""
    folder.mkdir()
    summary = make_track(prepare_track([str(source)], **options), folder, overlay=False)
    return np.genfromtxt(folder / "track.csv", delimiter=",", names=True), summary


def job(cell, seed, quick):
    """Returns the line of a file: its distances from the track of the images without compression [px]."""
    file = FILES[cell]
    clip = make_clip("plain", seed, 30 if quick else IMAGES)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "images").mkdir()
        for k, image in enumerate(clip.images):
            cv2.imwrite(str(folder / "images" / f"{k:04d}.png"), image)
        expected, _ = track(folder / "images", folder / "expected", fps=RATE)
        path = folder / f"clip.{file.suffix}"
        write(path, file, clip.images, np.random.default_rng(seed))
        found, summary = track(path, folder / "found")
    good = found["valid"] > 0
    stamps = found["stamp"][good]
    places = [np.interp(stamps, expected["stamp"], expected[column]) for column in "uv"]
    off = np.hypot(found["u"][good] - places[0], found["v"][good] - places[1])
    return {
        "off_px": off.tolist(),
        "images": len(found),
        "expected": len(expected),
        "valid": int(good.sum()),
        "dropped": summary["dropped"][0],
        "left_out": len(file.dropped),
    }


def summary(rows):
    """Returns the results of a cell."""
    off = np.concatenate([row["off_px"] for row in rows])
    keys = ("images", "expected", "valid", "dropped", "left_out")
    return {
        "clips": len(rows),
        "median_px": float(np.median(off)),
        "p95_px": float(np.percentile(off, 95)),
        **{key: sum(row[key] for row in rows) for key in keys},
    }
