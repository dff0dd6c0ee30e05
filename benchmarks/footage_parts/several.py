"""Several objects in the images of two calibrated cameras, for `footage.py`: identities, points, objects out of sight.

Two textured discs move straight across a table in 4 s, and pass each other near its middle. At the beginning and at the
end, they are apart in both images. All of a clip is drawn from its seed.
"""

import csv
import tempfile
from pathlib import Path

import cv2
import numpy as np
from footage_parts.clips import HEIGHT, NOISE, RATE, WIDTH, background, disc, paint

from drake_tracker.cameras.camera_model import CameraModel
from drake_tracker.cameras.files.calibration_file import save_calibration
from drake_tracker.campaign.rates import wilson
from drake_tracker.own_cameras import make_track, prepare_track

FOCUS, COUNT = 600.0, 120
"""Focal length of both cameras [px], and number of images."""
KINDS = ("crossing", "alike", "behind a post", "one camera")
"""Two objects; two that look alike; one that a post hides in the left image; one that only the left camera sees."""
POST = 60
"""Width of the post [px]."""
PASSES = 0.3
"""Share of the clip after which the object is in the middle of the post."""
APART = 100.0
"""Least distance of the objects in both images at the beginning and at the end [px]."""
FIRST = 15
"""Images at the beginning that do not count."""


def camera(x):
    """Returns a camera at (x, -1.2, 0.9) m that looks at the middle of the table."""
    eye = np.array([x, -1.2, 0.9])
    z = -eye / np.linalg.norm(eye)
    right = np.cross(z, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    X_CW = np.eye(4)
    X_CW[:3, :3] = [right, np.cross(z, right), z]
    X_CW[:3, 3] = -X_CW[:3, :3] @ eye
    K = np.array([[FOCUS, 0.0, 0.5 * (WIDTH - 1)], [0.0, FOCUS, 0.5 * (HEIGHT - 1)], [0.0, 0.0, 1.0]])
    return CameraModel(K, np.zeros(5), X_CW, WIDTH, HEIGHT)


def clip(kind, seed):
    """Returns (cameras, images of each, true paths (2, n, 3) [m], diameters (2,) [m])."""
    rng = np.random.default_rng([seed, KINDS.index(kind)])
    half = rng.uniform(0.3, 0.6)
    cameras = [camera(-half), camera(half)]
    time = np.arange(COUNT) / RATE
    paths = _paths(rng, cameras, time)
    greys = np.full(2, rng.choice([225.0, 25.0])) if kind == "alike" else rng.permutation([225.0, 25.0])
    sizes = rng.uniform(35.0, 50.0, 2)
    things = [disc(rng, size, grey) for size, grey in zip(sizes, greys)]
    diameters = sizes * float(np.linalg.norm(cameras[0].X_WC[:3, 3])) / FOCUS
    films = []
    for side, view in enumerate(cameras):
        sky, post = background(rng, WIDTH, HEIGHT), background(rng, WIDTH, HEIGHT)
        places = [view.project(path) for path in paths]
        hides = np.zeros(WIDTH, bool)
        if kind == "behind a post" and side == 0:
            middle = int(places[0][round(PASSES * COUNT)][0])
            hides[max(middle - POST // 2, 0) : max(middle + POST // 2, 0)] = True
        film = []
        for k in range(COUNT):
            image = sky.copy()
            far = np.argsort([-np.linalg.norm(path[k] - view.X_WC[:3, 3]) for path in paths])
            for number in far:
                if not (kind == "one camera" and number == 1 and side == 1):
                    paint(image, things[number], places[number][k], k)
            image[:, hides] = post[:, hides]
            film.append(np.clip(np.rint(image + rng.normal(0.0, NOISE, image.shape)), 0, 255).astype(np.uint8))
        films.append(film)
    return cameras, films, paths, diameters


def _paths(rng, cameras, time):
    """Returns the paths of two objects that cross (2, n, 3) [m]."""
    while True:
        angle, paths = rng.uniform(0.0, 2.0 * np.pi), []
        for turn in (angle, angle + np.pi + rng.uniform(-1.2, 1.2)):
            start = np.array([*rng.uniform(-0.05, 0.05, 2), rng.uniform(0.0, 0.1)])
            along = rng.uniform(0.12, 0.25) * (time - time[-1] * rng.uniform(0.4, 0.6))
            paths.append(start + along[:, None] * [np.cos(turn), np.sin(turn), 0.0])
        places = [[view.project(path[[0, -1]]) for path in paths] for view in cameras]
        if min(np.linalg.norm(one - other, axis=1).min() for one, other in places) >= APART:
            return np.array(paths)


def job(kind, seed, quick):
    """Returns the line of a clip: errors [m], as shares of the diameter too, and whether the identities were kept."""
    cameras, films, paths, diameters = clip(kind, seed)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for side, film in zip(("left", "right"), films):
            (folder / side).mkdir()
            for k, image in enumerate(film):
                cv2.imwrite(str(folder / side / f"{k:04d}.png"), image)
        models = {f"camera_{side}": model for side, model in zip(("left", "right"), cameras)}
        save_calibration(folder / "stereo.yaml", models)
        (folder / "out").mkdir()
        sources = [str(folder / side) for side in ("left", "right")]
        prepared = prepare_track(sources, fps=RATE, calibration=folder / "stereo.yaml", objects=2)
        made = make_track(prepared, folder / "out", overlay=False)
        with open(folder / "out" / "track.csv", newline="") as file:
            rows = [row for row in csv.DictReader(file) if row["id"]]
    errors, shares, owners = [], [], {}
    for row in rows:
        k = round(float(row["stamp"]) * RATE)
        if k < FIRST or row["valid"] != "1":
            continue
        off = np.linalg.norm(paths[:, k] - [float(row[axis]) for axis in "xyz"], axis=1)
        nearest = int(np.argmin(off / diameters))
        errors.append(float(off[nearest]))
        shares.append(float(off[nearest] / diameters[nearest]))
        if shares[-1] <= 0.5:
            owners.setdefault(row["id"], []).append(nearest)
    firsts = [each[0] for each in owners.values()]
    expected = [0] if kind == "one camera" else [0, 1]
    return {
        "errors_m": errors,
        "shares": shares,
        "hidden": sum(row["state"] == "hidden" for row in rows),
        "possible": len(expected) * (COUNT - 1 - FIRST),
        "kept": all(len(set(each)) == 1 for each in owners.values()) and sorted(firsts) == expected,
        "prediction_rms_m": made["prediction_rms_m"],
    }


def summary(rows):
    """Returns the results of a cell."""
    errors, shares = (np.concatenate([row[key] for row in rows]) for key in ("errors_m", "shares"))
    kept = sum(row["kept"] for row in rows)
    return {
        "clips": len(rows),
        "points": len(errors),
        "possible": sum(row["possible"] for row in rows),
        "hidden": sum(row["hidden"] for row in rows),
        "median_m": float(np.median(errors)),
        "p95_m": float(np.percentile(errors, 95)),
        "wrong": float(np.mean(shares > 0.5)),
        "kept": kept,
        "kept_wilson": wilson(kept, len(rows)),
    }
