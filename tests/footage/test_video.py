"""Videos of every container and codec, turned and damaged ones, against the images from which they were made."""

from fractions import Fraction

import av
import cv2
import numpy as np
import pytest
from films import film

from drake_tracker.footage.sources import open_footage
from drake_tracker.footage.video import FrameTimes, Orientation, read_orientation

COUNT = 24
FILM = film("left", np.arange(COUNT) / 30.0)
CODECS = {
    "libx264": ("yuv420p", {"crf": "16"}, ("mp4", "mov", "avi", "mkv")),
    "mpeg4": ("yuv420p", {"bf": "2", "b": "4000000"}, ("mp4", "avi", "mkv")),
    "mjpeg": ("yuvj420p", {}, ("mp4", "mov", "avi", "mkv")),
    "ffv1": ("yuv420p", {}, ("avi", "mkv")),
    "libvpx-vp9": ("yuv420p", {"b": "3000000", "deadline": "realtime", "cpu-used": "8"}, ("webm", "mkv")),
    "libx265": ("yuv420p", {"preset": "ultrafast", "x265-params": "log-level=none"}, ("mp4",)),
}


def write(path, codec, images=FILM, rotation=0):
    pixels, options, _ = CODECS[codec]
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=30, options=options)
        stream.height, stream.width = images[0].shape
        stream.pix_fmt = pixels
        stream.codec_context.thread_count = 1
        if rotation:
            stream.set_display_rotation(rotation)
        for k, image in enumerate(images):
            frame = av.VideoFrame.from_ndarray(cv2.cvtColor(image, cv2.COLOR_GRAY2RGB), format="rgb24")
            frame = frame.reformat(format=pixels)
            frame.pts, frame.time_base = k, Fraction(1, 30)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return str(path)


def ball(image):
    """Centre (u, v) [px] of the bright ball."""
    weight = np.clip(image.astype(float) - 100.0, 0.0, None)
    rows, columns = np.indices(weight.shape)
    return np.array([(weight * columns).sum(), (weight * rows).sum()]) / weight.sum()


@pytest.mark.parametrize(
    ("codec", "suffix"), [(codec, suffix) for codec, (*_, suffixes) in CODECS.items() for suffix in suffixes]
)
def test_every_container_and_codec_gives_every_image_at_its_time(tmp_path, codec, suffix):
    if codec not in av.codecs_available:
        pytest.fail(f"PyAV comes without {codec}")
    footage = open_footage(write(tmp_path / f"a.{suffix}", codec))
    times, images = zip(*footage.frames())
    np.testing.assert_allclose(times, np.arange(COUNT) / 30.0, atol=1.1e-3)
    np.testing.assert_allclose(footage.times, times)
    assert footage.warning() is None
    off = [np.abs(ball(image[..., 1]) - ball(original)).max() for image, original in zip(images, FILM)]
    assert max(off) < 0.5


@pytest.mark.parametrize("turns", [1, 2, 3])
def test_a_turned_video_is_upright(tmp_path, turns):
    stored = [np.ascontiguousarray(np.rot90(image, -turns)) for image in FILM[:6]]
    footage = open_footage(write(tmp_path / "a.mp4", "libx264", stored, 90 * turns))
    assert footage.size == (320, 240)
    for (_, image), original in zip(footage.frames(), FILM):
        assert np.abs(ball(image[..., 1]) - ball(original)).max() < 0.3


def test_a_display_matrix_maps_pixels_as_the_standard_says():
    image = np.arange(6 * 3, dtype=np.uint8).reshape(2, 3, 3)
    seen = set()
    for linear in ((1, 0, 0, 1), (-1, 0, 0, 1), (1, 0, 0, -1), (-1, 0, 0, -1), (0, 1, 1, 0), (0, -1, 1, 0)):
        a, b, c, d = linear
        matrix = np.array([a << 16, b << 16, 0, c << 16, d << 16, 0, 0, 0, 1 << 30], np.int32)
        orientation = read_orientation(matrix.tobytes())
        seen.add(orientation)
        shown = orientation.apply(image)
        assert shown.shape[1::-1] == orientation.size(3, 2)
        places = np.array([(a * p + c * q, b * p + d * q) for q in range(2) for p in range(3)])
        for (x, y), pixel in zip(places - places.min(axis=0), image.reshape(6, 3)):
            np.testing.assert_array_equal(shown[y, x], pixel)
    assert len(seen) == 6 and Orientation() in seen


@pytest.mark.parametrize(("codec", "suffix"), [("mjpeg", "avi"), ("libx264", "avi"), ("ffv1", "mkv"), ("mjpeg", "mov")])
@pytest.mark.parametrize("damage", ["cut", "noise"])
def test_what_can_be_decoded_of_a_damaged_file_is_kept(tmp_path, codec, suffix, damage):
    path = tmp_path / f"a.{suffix}"
    write(path, codec)
    data = bytearray(path.read_bytes())
    start = int(0.6 * len(data))
    if damage == "noise":
        data[start : start + 200] = np.random.default_rng(0).bytes(200)
    elif suffix == "mov":  # its index is at the end: without it, nothing can be read
        return
    else:
        del data[start:]
    path.write_bytes(data)
    footage = open_footage(str(path))
    seen = list(footage.frames())
    assert len(seen) >= 0.4 * COUNT and np.all(np.diff([time for time, _ in seen]) > 0.0)
    if len(seen) < COUNT:
        words = footage.warning()
        assert words is not None and "damaged or truncated" in words and "\n" not in words
    if damage == "cut":
        assert len(seen) < COUNT and f"{COUNT - len(seen)} of {COUNT} images" in footage.warning()


def test_an_unusual_name_is_a_name_like_any_other(tmp_path):
    folder = tmp_path / "видео 映像 é"
    folder.mkdir()
    name = folder / ("ü" * 120 + ".mkv")
    assert len(list(open_footage(write(name, "ffv1", FILM[:3])).frames())) == 3


def test_times_that_run_backwards_are_repaired():
    decoded = FrameTimes([10, 20, 30, 40], reordered=True)  # decode times only: the frames' own are in another order
    assert [decoded.next(own) for own in (10, 40, 30, 20)] == [10, 20, 30, 40]
    shown = FrameTimes([10, 40, 20, 50], reordered=True)
    assert [shown.next(own) for own in (10, 20, 40, 50)] == [10, 20, 40, 50]
    broken = FrameTimes([10, 20, 5, 30], reordered=False)
    assert [broken.next(own) for own in (10, 20, 5, 30)] == [10, 20, 30, 31]
