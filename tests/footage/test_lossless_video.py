import numpy as np
import pytest

from drake_tracker.footage.encoded_video import LosslessVideo
from drake_tracker.footage.sources import open_footage


@pytest.fixture
def images():
    rng = np.random.default_rng(0)
    return rng.integers(0, 256, (200, 21, 33), dtype=np.uint8)  # odd sizes, all grey levels


def write(path, images):
    video = LosslessVideo(path, 60, images.shape[:0:-1])
    for image in images:
        video.write(image)
    return video


def test_every_pixel_is_read_back(tmp_path, images):
    video = write(tmp_path / "a.mkv", images)
    video.close()
    video.close()
    footage = open_footage(str(tmp_path / "a.mkv"), fps=60.0)
    assert footage.size == (33, 21) and len(footage.times) == len(images)
    read = np.array([image for _, image in footage.frames()])
    np.testing.assert_array_equal(read, np.repeat(images[..., None], 3, axis=-1))


def test_every_colour_is_read_back(tmp_path):
    images = np.random.default_rng(1).integers(0, 256, (50, 21, 33, 4), dtype=np.uint8)
    images[..., 3] = 255
    video = LosslessVideo(tmp_path / "a.mkv", 60, (33, 21), colour=True)
    for image in images:
        video.write(image)
    video.close()
    read = np.array([image for _, image in open_footage(str(tmp_path / "a.mkv"), fps=60.0).frames()])
    np.testing.assert_array_equal(read, images[..., :3])


def test_a_file_that_was_not_closed_lacks_at_most_the_last_second(tmp_path, images):
    video = write(tmp_path / "a.mkv", images)
    (tmp_path / "cut.mkv").write_bytes((tmp_path / "a.mkv").read_bytes())
    video.close()
    read = [image[..., 0] for _, image in open_footage(str(tmp_path / "cut.mkv"), fps=60.0).frames()]
    assert len(images) - 61 <= len(read) <= len(images)
    np.testing.assert_array_equal(read, images[: len(read)])
