"""Tests of the video file."""

import cv2
import numpy as np
import pytest

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.run.video_file import VideoFile


def frame(k, size=(160, 96)):
    image = np.full((size[1], size[0], 3), 40, np.uint8)
    image[30:60, 4 * k : 4 * k + 20] = (30, 120, 230)
    return image


def read(path):
    capture = cv2.VideoCapture(str(path))
    images = []
    while True:
        ok, image = capture.read()
        if not ok:
            return images, capture.get(cv2.CAP_PROP_FPS), int(capture.get(cv2.CAP_PROP_FOURCC)).to_bytes(4, "little")
        images.append(image)


def test_frames_are_read_back(tmp_path):
    video = VideoFile(tmp_path / "v.mp4", 30, (160, 96))
    for k in range(35):
        video.write(frame(k))
    video.close()
    images, rate, codec = read(tmp_path / "v.mp4")
    assert len(images) == 35 and rate == 30.0
    assert codec.lower() in (b"h264", b"avc1")
    for k in (0, 17, 34):
        assert np.abs(images[k].astype(int) - frame(k)).mean() < 4.0
    assert list(tmp_path.iterdir()) == [tmp_path / "v.mp4"]


@pytest.mark.parametrize("size", [(160, 96), (160, 98), (162, 96), (162, 98), (130, 66)])
def test_colours_are_read_back_at_every_size(size, tmp_path):
    """Widths and heights that are 0 and 2 modulo 4. The decoder is that of OpenCV, the encoder that of PyAV."""
    width, height = size
    stripes = np.zeros((height, width, 3), np.uint8)
    colours = np.array([(200, 40, 40), (40, 200, 40), (40, 40, 200)])
    rows = np.arange(height)
    stripes[:] = colours[rows // 12 % 3][:, None]
    video = VideoFile(tmp_path / "v.mp4", 10, size)
    for _ in range(5):
        video.write(stripes)
    video.close()
    seen = read(tmp_path / "v.mp4")[0][-1].astype(int)
    assert seen.shape == stripes.shape
    inside = (rows % 12 >= 3) & (rows % 12 < 9)  # colours at the edges of the stripes are mixed
    assert np.abs(seen - stripes)[inside].max() < 25


def test_written_frames_are_readable_before_the_file_is_closed(tmp_path):
    """A run that is killed loses at most the last second."""
    video = VideoFile(tmp_path / "v.mp4", 10, (160, 96))
    for k in range(35):
        video.write(frame(k))
    images, _, _ = read(tmp_path / "v.mp4")
    assert len(images) >= 20
    video.close()
    assert len(read(tmp_path / "v.mp4")[0]) == 35


def test_a_file_can_be_closed_twice_and_without_frames(tmp_path):
    video = VideoFile(tmp_path / "v.mp4", 30, (160, 96))
    video.close()
    video.close()


def write_frames(video, count):
    for k in range(count):
        video.write(frame(k))


def test_a_full_disk_raises_an_error_once_and_does_not_crash():
    video = VideoFile("/dev/full", 10, (160, 96))
    with pytest.raises(DrakeTrackerError, match="^/dev/full: cannot be written: No space left"):
        write_frames(video, 35)
    video.close()
