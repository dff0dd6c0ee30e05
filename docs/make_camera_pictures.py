"""Makes the pictures of the pages on your own cameras: what a track looks like when something is wrong.

    python docs/make_camera_pictures.py [--out docs/images]

Runs docs/how_to/make_rehearsal.py, changes its clips, and tracks them. With Debian's chromium and
Playwright (extra `test`), it also photographs the page of a live track.
"""

import argparse
import os
import re
import runpy
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import cv2
import numpy as np
from PIL import Image

SCRIPT = Path(__file__).parent / "how_to" / "make_rehearsal.py"
CHROMIUM = "/usr/bin/chromium"
COLOURS = 128
"""Size of the palette, which keeps the pictures small."""
SHOWN_AT = 1.3
"""Time of the frames that are shown [s]: the ball moves."""


def tracker(*arguments):
    """Runs drake-tracker in the current folder."""
    subprocess.run([sys.executable, "-m", "drake_tracker", *arguments], check=False, stdout=subprocess.DEVNULL)


def write_clip(path, images):
    """Writes grey images as a video."""
    video = cv2.VideoWriter(path, cv2.VideoWriter.fourcc(*"mp4v"), 30, images[0].shape[::-1], isColor=False)
    for image in images:
        video.write(image)
    video.release()


def read_clip(path):
    """Returns the grey images of a video."""
    video, images = cv2.VideoCapture(path), []
    while (read := video.read())[0]:
        images.append(cv2.cvtColor(read[1], cv2.COLOR_BGR2GRAY))
    return images


def frame(folder, at=SHOWN_AT):
    """Returns the frame of an overlay video at a time [s], BGR."""
    video = cv2.VideoCapture(f"{folder}/overlay.mp4")
    video.set(cv2.CAP_PROP_POS_FRAMES, round(30 * at))
    return video.read()[1]


def titled(image, title):
    """Returns a BGR image with a line of text above it."""
    band = np.full((34, image.shape[1], 3), 255, np.uint8)
    cv2.putText(band, title, (6, 24), cv2.FONT_HERSHEY_SIMPLEX, 0.62, (40, 30, 27), 1, cv2.LINE_AA)
    return np.vstack([band, image])


def save(path, rows):
    """Saves BGR images below each other, with a small palette."""
    width = max(row.shape[1] for row in rows)
    rows = [
        cv2.copyMakeBorder(row, 0, 8, 0, width - row.shape[1], cv2.BORDER_CONSTANT, value=(255,) * 3) for row in rows
    ]
    whole = Image.fromarray(cv2.cvtColor(np.vstack(rows), cv2.COLOR_BGR2RGB))
    whole = whole.resize((round(0.7 * whole.width), round(0.7 * whole.height)), Image.Resampling.LANCZOS)
    whole.quantize(COLOURS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE).save(path, optimize=True)
    print(f"{path}: {path.stat().st_size / 1000:.0f} kB")


def draw_problems(out):
    """Draws the pictures of the page on typical problems."""
    stereo = ["--calibration", "stereo.yaml"]
    tracker("track", "left.mp4", "right.mp4", *stereo, "--out", "good")
    tracker("track", "left.mp4", "right.mp4", *stereo, "--offset", "0.2", "--duration", "4", "--out", "late")
    save(
        out / "problem_offset.png",
        [
            titled(frame("good"), "Recordings of the same moment"),
            titled(frame("late"), "The right recording began 0.2 s later than assumed: wrong path, z 46 mm too high"),
        ],
    )
    left = read_clip("left.mp4")
    other = []
    for k, image in enumerate(left):
        other.append(image.copy())
        cv2.circle(other[-1], (round(560 - 2.2 * k), 400), 38, 30, -1, cv2.LINE_AA)
    write_clip("other.mp4", other)
    write_clip("other_seen.mp4", other[12:])
    tracker("track", "other.mp4", "--out", "other")
    u, v = first_place()
    tracker("track", "other.mp4", "--follow", f"{u},{v}", "--out", "followed")
    beside = [frame(name) for name in ("other", "followed")]
    save(
        out / "problem_other.png",
        [titled(beside[0], "A larger object moves too, and is tracked"), titled(beside[1], "With --follow")],
    )
    rng = np.random.default_rng(3)
    shaken = [
        cv2.warpAffine(image, np.float32([[1, 0, du], [0, 1, dv]]), image.shape[::-1], borderMode=cv2.BORDER_REFLECT)
        for image, (du, dv) in zip(left, rng.normal(0.0, 1.5, (len(left), 2)))
    ]
    write_clip("shaken.mp4", shaken)
    tracker("track", "shaken.mp4", "--out", "shaken")
    save(out / "problem_shake.png", [titled(frame("shaken"), "The camera shakes; the overlay says so")])


def first_place():
    """Returns the pixel of the ball in the first image of the left camera."""
    track = np.genfromtxt("good/track.csv", delimiter=",", names=True)
    seen = track[np.isfinite(track["left_u"]) & (track["valid"] == 1)][2]
    return round(seen["left_u"]), round(seen["left_v"])


def draw_codes(out):
    """Draws photographs of the running code, good and bad, and whether they can be read."""
    from drake_tracker.cameras.latency import draw_code, read_code

    code = draw_code([107, 57, 73, 90], 10)
    flat = np.float32([[0, 0], [310, 0], [310, 170], [0, 170]])

    def seen(corners, blur=0.8):
        H = cv2.getPerspectiveTransform(flat, np.float32(corners))
        image = cv2.warpPerspective(code, H, (400, 260), flags=cv2.INTER_AREA, borderValue=50)
        return cv2.GaussianBlur(image, (0, 0), blur)

    whole = [[40, 45], [355, 35], [365, 220], [50, 205]]
    bright = seen(whole).astype(float)
    glare = np.exp(-((np.mgrid[:260, :400][0] - 110) ** 2 + (np.mgrid[:260, :400][1] - 150) ** 2) / 2000.0)
    pictures = [
        ("good", seen(whole)),
        ("out of focus", seen(whole, 6.0)),
        ("partly out of view", seen([[-110, 45], [225, 35], [235, 220], [-100, 205]])),
        ("reflection", np.clip(bright + 400 * glare, 0, 255).astype(np.uint8)),
    ]
    tiles = []
    for words, image in pictures:
        verdict = "not readable" if read_code(image) is None else "readable"
        tiles.append(titled(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR), f"{words}: {verdict}"))
    save(out / "problem_code.png", [np.hstack(tiles[:2]), np.hstack(tiles[2:])])


def photograph_page(path):
    """Photographs the page of a live track of the clips."""
    from playwright.sync_api import sync_playwright

    for side in ("left", "right"):
        images = read_clip(f"{side}.mp4")
        write_clip(f"{side}.mp4", (images + images[::-1]) * 3)
    command = [sys.executable, "-m", "drake_tracker", "track", "left.mp4", "right.mp4"]
    command += ["--calibration", "stereo.yaml", "--live", "--no-overlay", "--out", "page"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    url = re.search(r"http://\S+", process.stdout.readline())[0]
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1280, "height": 800})
        page.goto(url)
        while float(page.locator("#time").inner_text()) < 6.6:
            time.sleep(0.02)
        page.locator("#pause").click()
        time.sleep(1.0)
        page.screenshot(path=str(path))
        browser.close()
    process.send_signal(signal.SIGINT)
    process.wait()
    Image.open(path).convert("RGB").quantize(256, Image.Quantize.MAXCOVERAGE, kmeans=2, dither=Image.Dither.NONE).save(
        path, optimize=True
    )
    print(f"{path}: {path.stat().st_size / 1000:.0f} kB")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path(__file__).parent / "images")
    out = parser.parse_args().out.resolve()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        runpy.run_path(str(SCRIPT))
        board = ["--kind", "charuco", "--board", "8x6", "--square", "0.03", "--world"]
        tracker("calibrate", "shots/left*.png", "shots/right*.png", *board, "-o", "stereo.yaml")
        draw_codes(out)
        draw_problems(out)
        if Path(CHROMIUM).exists():
            photograph_page(out / "live_track.png")


if __name__ == "__main__":
    main()
