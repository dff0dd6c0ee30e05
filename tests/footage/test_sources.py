import itertools

import cv2
import numpy as np
import pytest
from films import film, write_images, write_video

from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.footage.image_folder import list_images
from drake_tracker.footage.live_camera import open_camera
from drake_tracker.footage.sources import open_footage

TIMES = np.arange(12) / 30.0
GREY = [np.full((16, 24), 10 * k, np.uint8) for k in range(12)]


def levels(footage):
    return [round(float(image.mean()) / 10) for _, image in footage.frames()]


def test_a_video_has_the_containers_times(tmp_path):
    kept = [0, 1, 2, 5, 6, 7, 8, 9, 10, 11]
    path = write_video(tmp_path / "a.mkv", [GREY[k] for k in kept], TIMES[kept] + 7.0)
    footage = open_footage(path)
    assert footage.size == (24, 16) and not footage.live
    np.testing.assert_allclose(footage.times, TIMES[kept], atol=1.1e-3)
    times, images = zip(*footage.frames())
    np.testing.assert_allclose(times, footage.times)
    assert [round(float(image.mean()) / 10) for image in images] == kept
    np.testing.assert_allclose(open_footage(path, fps=10.0).times, np.arange(10) / 10.0)


def test_images_are_timed_by_the_numbers_in_their_names(tmp_path):
    counted = open_footage(write_images(tmp_path / "counted", GREY[:3], [9, 10, 12]), fps=20.0)
    np.testing.assert_allclose(counted.times, [0.0, 0.05, 0.15])
    assert levels(counted) == [0, 1, 2] and counted.epoch == pytest.approx(0.45) and counted.counted
    for folder, names, epoch in (
        ("ns", ["1700000000000000000", "1700000000050000000"], 1.7e9),
        ("seconds", ["1305031102.175304", "1305031102.225304"], 1305031102.175304),
    ):
        (tmp_path / folder).mkdir()
        for name, image in zip(names, GREY):
            cv2.imwrite(str(tmp_path / folder / f"{name}.png"), image)
        footage = open_footage(str(tmp_path / folder))
        np.testing.assert_allclose(footage.times, [0.0, 0.05], atol=1e-6)
        assert footage.epoch == pytest.approx(epoch, abs=1e-6) and not footage.counted
    assert len(open_footage(str(tmp_path / "counted" / "image*9.png"), fps=1.0).times) == 1


def test_what_systems_hide_beside_images_and_folders_are_no_images(tmp_path):
    folder = write_images(tmp_path / "images", GREY[:3])
    (tmp_path / "images" / "._image00001.png").write_text("of another system")
    (tmp_path / "images" / "more.png").mkdir()
    assert levels(open_footage(folder, fps=20.0)) == [0, 1, 2]


@pytest.mark.parametrize("top", [255 * 16 + 15, 65535])
def test_of_12_bits_in_16_none_are_lost(tmp_path, top):
    ramp = np.linspace(0, top, 24 * 16).reshape(16, 24)
    for k, share in enumerate((1.0, 0.05)):
        cv2.imwrite(str(tmp_path / f"{k}.png"), (share * ramp).astype(np.uint16))
    footage = open_footage(str(tmp_path), fps=20.0)
    bright, dark = [image.astype(float).mean() for _, image in footage.frames()]
    assert bright == pytest.approx(127, abs=2) and dark == pytest.approx(0.05 * 127, abs=1)


def test_a_time_of_day_in_a_name_orders_and_no_more(tmp_path):
    for name, image in zip(("12-00-59.95", "12-01-00.00", "12-01-00.05"), GREY):
        cv2.imwrite(str(tmp_path / f"{name}.png"), image)
    footage = open_footage(str(tmp_path), fps=20.0)
    assert levels(footage) == [0, 1, 2] and footage.epoch is None
    np.testing.assert_allclose(footage.times, [0.0, 0.05, 0.1])


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda folder: with_another(write_images(folder / "images", GREY)), "background.png has no number and others"),
        (lambda folder: "\u00b2", "there is no such file, folder or camera"),
        (lambda folder: "9" * 23, "there is no such file, folder or camera"),
        (lambda folder: str(folder / "nowhere.mp4"), "nowhere.mp4: there is no such file, folder or camera"),
        (lambda folder: text_file(folder / "a.mp4"), "a.mp4: this video cannot be read: "),
        (lambda folder: str(folder), "there are no images"),
        (lambda folder: str(folder / "no*.png"), "no file matches it"),
        (lambda folder: write_images(folder / "images", GREY), "add --fps N"),
        (lambda folder: write_images(folder / "images", GREY[:2]) + "/*.txt", "no file matches it"),
        (lambda folder: "97", "camera 97: there is no such camera"),
    ],
)
def test_what_cannot_be_read_is_one_line(tmp_path, make, message, capfd):
    with pytest.raises(DrakeTrackerError, match=message) as caught:
        open_footage(make(tmp_path))
    assert "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")


def with_another(folder):
    cv2.imwrite(f"{folder}/background.png", GREY[0])
    return folder


def text_file(path):
    path.write_text("this is no video")
    return str(path)


def test_a_broken_image_and_one_of_another_size_are_named(tmp_path, capfd):
    folder = write_images(tmp_path / "images", GREY[:3])
    (tmp_path / "images" / "image00003.png").write_text("this is no image")
    footage = open_footage(folder, fps=1.0)
    assert [time for time, _ in footage.frames()] == [0.0, 1.0, 2.0]
    assert footage.warning().endswith("1 of 4 images cannot be read: image00003.png")
    cv2.imwrite(str(tmp_path / "images" / "image00003.png"), np.zeros((4, 4), np.uint8))
    with pytest.raises(DrakeTrackerError, match="image00003.png has 4 x 4 px, .* have 24 x 16"):
        list(open_footage(folder, fps=1.0).frames())
    assert capfd.readouterr().err == ""


def test_a_video_that_breaks_off_gives_what_it_has(tmp_path):
    path = tmp_path / "a.mkv"
    write_video(path, film("left", np.arange(30) / 30.0), np.arange(30) / 30.0)
    data = bytearray(path.read_bytes())
    data[len(data) // 2 :] = bytes(len(data) - len(data) // 2)
    path.write_bytes(data)
    footage = open_footage(str(path))
    seen = list(footage.frames())
    assert 5 < len(seen) < 30
    assert f"damaged or truncated: {30 - len(seen)} of 30 images" in footage.warning()


class Device:
    """Stands in for an OpenCV camera that stops after some images."""

    def __init__(self, number, count=5):
        self.left, self.number = count, number
        self.released = False

    def isOpened(self):
        return self.number == 0

    def set(self, key, value):
        self.rate = value

    def get(self, key):
        return 0.0

    def grab(self):
        self.left -= 1
        return self.left >= 0

    def retrieve(self):
        return True, np.full((4, 6, 3), (0, 0, 200), np.uint8)

    def read(self):
        return self.grab(), self.retrieve()[1]

    def release(self):
        self.released = True


def test_a_camera_stamps_by_the_clock():
    clock = itertools.count(100.0, 0.05)
    footage = open_camera(0, device=Device, clock=lambda: next(clock))
    assert footage.live and footage.size == (6, 4) and (footage.epoch, footage.rate) == (100.0, 30.0)
    frames = footage.frames()
    seen = [(round(time, 6), tuple(image[0, 0].tolist())) for time, image in itertools.islice(frames, 5)]
    with pytest.raises(DrakeTrackerError, match="camera 0: it delivers no more images"):
        next(frames)
    assert seen == [(t, (200, 0, 0)) for t in (0.0, 0.05, 0.1, 0.15, 0.2)]
    with pytest.raises(DrakeTrackerError, match="camera 1: there is no such camera"):
        open_camera(1, device=Device)


def test_a_number_is_a_camera_unless_it_has_leading_zeros(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("00", "7"):
        (tmp_path / name).mkdir()
        for k in range(9):
            cv2.imwrite(str(tmp_path / name / f"{k}.png"), np.zeros((4, 6), np.uint8))
    assert open_footage("00", 30.0).size == (6, 4) and open_footage("./7", 30.0).size == (6, 4)
    with pytest.raises(DrakeTrackerError, match=r"camera 7: .*; write \./7 for what is named so in this folder"):
        open_footage("7")


@pytest.mark.parametrize("name", ["[a]", "b*", "c?"])
def test_signs_of_patterns_in_names(tmp_path, name):
    (tmp_path / name).mkdir()
    for k in range(9):
        cv2.imwrite(str(tmp_path / name / f"{k}.png"), np.zeros((4, 6), np.uint8))
    assert len(open_footage(str(tmp_path / name), 30.0).times) == 9


def test_a_video_is_no_photograph(tmp_path):
    (tmp_path / "a.mp4").write_bytes(b"a")
    with pytest.raises(DrakeTrackerError, match="a.mp4: is no photograph; name a folder of them"):
        list_images(tmp_path / "a.mp4")
