"""Tests of the boundary around decoders: sizes, orientation, number of bits, and errors of any kind."""

import struct
import zlib

import cv2
import numpy as np
import pytest

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.footage.decoding import LARGEST_IMAGE, common_orientation, decode, decoding, read_file
from drake_tracker.footage.image_folder import open_images, read_image
from drake_tracker.footage.sources import open_footage

RNG = np.random.default_rng(0)
SMOOTH = cv2.resize(RNG.integers(0, 255, (4, 5, 3), np.uint8), (80, 64), interpolation=cv2.INTER_CUBIC)


def exif(orientation):
    entry = struct.pack("<HHIHH", 0x112, 3, 1, orientation, 0)
    body = b"Exif\0\0II*\0" + struct.pack("<IH", 8, 1) + entry + struct.pack("<I", 0)
    return b"\xff\xe1" + struct.pack(">H", len(body) + 2) + body


def jpeg(image, orientation=None):
    data = cv2.imencode(".jpg", image)[1].tobytes()
    return data if orientation is None else data[:2] + exif(orientation) + data[2:]


def png_header(width, height):
    chunks = [b"IHDR" + struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0), b"IDAT" + zlib.compress(b""), b"IEND"]
    coded = [struct.pack(">I", len(each) - 4) + each + struct.pack(">I", zlib.crc32(each)) for each in chunks]
    return b"\x89PNG\r\n\x1a\n" + b"".join(coded)


def jpeg_header(width, height):
    return (
        b"\xff\xd8\xff\xc0" + struct.pack(">HBHHB", 17, 8, height, width, 3) + b"\1\x22\0\2\x11\1\3\x11\1" + b"\xff\xd9"
    )


def tiff_header(width, height):
    entries = [(256, 4, 1, width), (257, 4, 1, height), (258, 3, 1, 8), (277, 3, 1, 3)]
    return (
        b"II*\0" + struct.pack("<IH", 8, len(entries)) + b"".join(struct.pack("<HHII", *e) for e in entries) + b"\0" * 4
    )


@pytest.mark.parametrize("header", [png_header, jpeg_header, tiff_header])
def test_the_size_is_read_before_the_image_is_decoded(tmp_path, header):
    side = 60_000
    with pytest.raises(DrakeTrackerError, match=rf"a: this image has {side} x {side} px; at most 100 million pixels"):
        decode(header(side, side), "a")
    assert side**2 > LARGEST_IMAGE > 12_000 * 8_000


@pytest.mark.parametrize("data", [b"", b"no image", png_header(10, 10), jpeg_header(10, 10), jpeg(SMOOTH)[:20]])
def test_a_damaged_image_is_one_line(data):
    with pytest.raises(DrakeTrackerError, match="^a: this image cannot be read") as caught:
        decode(data, "a")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (ValueError("31 is not\n a valid Type"), "31 is not a valid Type"),
        (MemoryError(), "there is not enough memory"),
        (KeyError(), "KeyError"),
        (OSError(28, "No space left on device"), "No space left on device"),
        (cv2.error("OpenCV(5) error"), "OpenCV"),
    ],
)
def test_any_exception_of_a_decoder_is_one_line(error, words):
    with pytest.raises(DrakeTrackerError, match=f"^a.png: this image cannot be read: .*{words}"), decoding("a.png"):
        raise error


def write_set(folder, tags, images=None):
    folder.mkdir()
    for k, tag in enumerate(tags):
        (folder / f"{k}.jpg").write_bytes(jpeg(SMOOTH if images is None else images[k], tag))
    return folder


TURNED = {
    1: SMOOTH, 2: SMOOTH[:, ::-1], 3: SMOOTH[::-1, ::-1], 4: SMOOTH[::-1], 5: SMOOTH.swapaxes(0, 1),
    6: cv2.rotate(SMOOTH, cv2.ROTATE_90_CLOCKWISE), 7: cv2.rotate(SMOOTH.swapaxes(0, 1), cv2.ROTATE_180),
    8: cv2.rotate(SMOOTH, cv2.ROTATE_90_COUNTERCLOCKWISE),
}  # fmt: skip


@pytest.mark.parametrize("tag", TURNED)
def test_the_orientation_of_a_set_is_applied_to_all_of_it(tmp_path, tag):
    folder = write_set(tmp_path / "set", [tag] * 8)
    footage = open_images(folder, fps=30.0)
    shown = [image for _, image in footage.frames()]
    assert footage.warning() is None and footage.size == TURNED[tag].shape[1::-1]
    assert all(np.abs(image[..., ::-1].astype(int) - TURNED[tag]).mean() < 6.0 for image in shown)


@pytest.mark.parametrize("odd", [3, 6, 8])
def test_images_with_another_orientation_are_named_and_shown_like_the_others(tmp_path, odd):
    """Turned by its own tag, an image would show each pixel of the camera at another place."""
    folder = write_set(tmp_path / "set", [1, 1, odd, 1, 1, 1, None, 1])
    footage = open_images(folder, fps=30.0)
    assert all(np.abs(image[..., ::-1].astype(int) - SMOOTH).mean() < 6.0 for _, image in footage.frames())
    assert footage.warning() == (
        f"{folder / '2.jpg'}: has the EXIF orientation {odd}, and most of these images have 1, which is used for all "
        "of them"
    )


def test_photographs_are_read_as_the_camera_took_them(tmp_path):
    (tmp_path / "a.jpg").write_bytes(jpeg(SMOOTH, 6))
    assert read_image(tmp_path / "a.jpg").shape == SMOOTH.shape
    turn, line = common_orientation([tmp_path / "a.jpg"])
    assert turn.apply(SMOOTH).shape == TURNED[6].shape and line is None


@pytest.mark.parametrize("name", ["a.jpg", "a.tif", "a.png"])
def test_a_single_image_is_no_recording(tmp_path, name):
    assert cv2.imwrite(str(tmp_path / name), SMOOTH)
    with pytest.raises(DrakeTrackerError, match=f"{name}: is a single image; name a folder of images, or a video"):
        open_footage(str(tmp_path / name), 30.0)


def test_a_stack_of_images_is_named(tmp_path):
    assert cv2.imwritemulti(str(tmp_path / "a.tif"), [SMOOTH] * 5)
    with pytest.raises(DrakeTrackerError, match="a.tif: is a stack of 5 images; write each to a file"):
        open_footage(str(tmp_path / "a.tif"), 30.0)


@pytest.mark.parametrize(("tag", "size"), [(None, (80, 64)), (1, (80, 64)), (6, (64, 80)), (3, (80, 64))])
def test_motion_jpeg_with_exif_data(tmp_path, tag, size):
    (tmp_path / "a.mjpeg").write_bytes(jpeg(SMOOTH, tag) * 10)
    footage = open_footage(str(tmp_path / "a.mjpeg"), 30.0)
    shown = [image for _, image in footage.frames()]
    assert len(shown) == 10 and footage.size == size
    assert np.abs(shown[0][..., ::-1].astype(int) - TURNED[tag or 1]).mean() < 8.0


def write_deep(folder, brightest):
    folder.mkdir()
    for k, most in enumerate(brightest):
        image = np.linspace(0, most, 64 * 80).reshape(64, 80).astype(np.uint16)
        assert cv2.imwrite(str(folder / f"{k:02d}.png"), image)
    return folder


def test_the_number_of_bits_is_that_of_the_sequence(tmp_path):
    footage = open_images(write_deep(tmp_path / "deep", [300, *[60_000] * 9]), fps=30.0)
    images = [image for _, image in footage.frames()]
    assert images[0].max() == 300 >> 8 and images[5].max() == 60_000 >> 8 and footage.warning() is None


def test_images_that_are_clipped_are_counted(tmp_path):
    brightest = [4000] * 100
    brightest[5] = brightest[6] = 5000  # between those that are looked at
    footage = open_images(write_deep(tmp_path / "deep", brightest), fps=30.0)
    for _ in footage.frames():
        pass
    assert footage.warning() == (
        f"{tmp_path / 'deep'}: in 2 of 100 images more than 1% of the pixels are above 12 bits, and shown as white"
    )


def test_a_file_that_cannot_be_read(tmp_path):
    with pytest.raises(DrakeTrackerError, match="nothing.png: this image cannot be read: No such file"):
        read_file(tmp_path / "nothing.png")
