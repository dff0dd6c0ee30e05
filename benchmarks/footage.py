"""Measures how well `drake-tracker track` follows an object in image coordinates, beside trackers of OpenCV.

    python benchmarks/footage.py               all parts but speed, on two processes; resumes
    python benchmarks/footage.py --part files  one part
    python benchmarks/footage.py --part speed  images per second of the whole command, on a quiet machine
    python benchmarks/footage.py --quick       a trial on seeds of its own; nothing is written to the results

**accuracy**: the clips are drawn (`footage_parts/clips.py`), so that the true centre of every object is known. `track`
gets the pixel of the object in the first image (beside the larger mover, ``--follow``) or nothing; CSRT, KCF, MIL and
median flow the true rectangle in the first image; MOG2 nothing: the centroid of its largest contour. Each describes
every image after the first ten. A place is wrong when it is farther from the truth than half of the object's size, and
10 px. CSRT, KCF and median flow are measured where OpenCV has them: in opencv-contrib-python-headless.

**photographs**: the same before photographs, where scikit-image is installed (`footage_parts/photographs.py`).

**files**: the same clip in other containers and codecs, turned, with dropped images (`footage_parts/files.py`).

**fast**: a small fast ball beside a large slow mover, and in front of it, with ``--follow`` (`footage_parts/fast.py`).

**hidden**: an object that passes behind a pillar (`footage_parts/hidden.py`).

**person**: the share of filtered points of a walking figure (`footage_parts/person.py`).

**several**: two objects that two calibrated cameras see (`footage_parts/several.py`): identities, and errors of the
points in space. A point is wrong when it is farther from every object than half of its diameter.

Seeds 7640 to 7679 are used nowhere else.
"""

import subprocess
import sys
import tempfile
import time
from pathlib import Path

import av
import cv2
import numpy as np
from footage_parts import fast as footage_fast
from footage_parts import files as footage_files
from footage_parts import hidden as footage_hidden
from footage_parts import person as footage_person
from footage_parts import photographs as footage_photographs
from footage_parts import several as footage_several
from footage_parts import stereo as footage_stereo
from footage_parts.clips import KINDS, RATE, make_clip
from result_tables.footage_tables import DECODING, TABLES
from shared import common, parts
from shared.parts import Part, Timed

import drake_tracker
from drake_tracker.campaign.rates import wilson
from drake_tracker.vision.centroid.config import NormalFlow
from drake_tracker.vision.centroid.normal_flow import NormalFlowDetector
from drake_tracker.vision.image_tracks.image_tracker import ImageTracker
from drake_tracker.vision.image_tracks.track_2d import TrackState2D

RESULTS = common.RESULTS / "footage.json"
FOLDER = Path(__file__).resolve().parents[1] / "runs" / "footage"
PACKAGE = Path(drake_tracker.__file__).parent
FIRST = 10
"""Images at the beginning that do not count: every method needs some to learn the scene, or to find the object."""
WRONG = 10.0
"""See above [px]."""
STEREO = "two cameras of 1088 x 1920 px"
METHODS = ("track", "MOG2", "CSRT", "KCF", "MIL", "median flow")
CELLS = {f"{kind}: {method}": (kind, method) for kind in KINDS for method in METHODS}
PHOTOGRAPHED = {f"{kind}: {method}": (kind, method) for kind in footage_photographs.KINDS for method in METHODS}


def follow(clip, kind):
    """Yields (number of the image, places of the objects or None, whether each can be seen) as `track` finds them."""
    detector = NormalFlowDetector(NormalFlow(stride=1), period=1.0 / RATE)
    count = 2 if kind == "crossing" else 1
    tracker = ImageTracker(count, tuple(clip.truth[0, 0]) if kind == "rival" else None, period=1.0 / RATE)
    objects, images = tracker.start(), []
    for k, image in enumerate(clip.images):
        images = [*images, detector.smooth(image)][-3:]
        if len(images) < 3:
            continue
        objects, _, centroid = tracker.update(objects, (k - 1) / RATE, detector, images)
        if kind == "crossing":
            tracks = [objects.target(place) for place in range(count)]
            seen = [track is not None and track.state != TrackState2D.HIDDEN for track in tracks]
            yield k - 1, [None if track is None else track.mean[:2] for track in tracks], seen
        else:
            yield k - 1, [None if centroid is None else np.array([centroid.u, centroid.v])], [centroid is not None]


def largest_contour(clip, kind):
    """Yields the same of the largest contour of MOG2's foreground."""
    subtractor = cv2.createBackgroundSubtractorMOG2(detectShadows=False)
    for k, image in enumerate(clip.images):
        mask = cv2.morphologyEx(subtractor.apply(image), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8))
        contours = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)[0]
        largest = max(contours, key=cv2.contourArea, default=None)
        moments = None if largest is None else cv2.moments(cv2.convexHull(largest))
        if moments is None or moments["m00"] == 0.0:
            yield k, [None], [False]
        else:
            yield k, [np.array([moments["m10"], moments["m01"]]) / moments["m00"]], [True]


OPENCV = {
    "MIL": (cv2, "TrackerMIL"),
    "CSRT": (cv2, "TrackerCSRT"),
    "KCF": (cv2, "TrackerKCF"),
    "median flow": (getattr(cv2, "legacy", None), "TrackerMedianFlow"),
}
"""{method: (module of OpenCV, class)}."""


def of_opencv(name):
    """Returns a function that yields the same of a tracker of OpenCV, which starts with the true rectangle."""

    def tracked(clip, kind):
        cv2.setRNGSeed(0)
        module, kind_of_tracker = OPENCV[name]
        tracker = getattr(module, kind_of_tracker).create()
        side = round(clip.size)
        corner = np.rint(clip.truth[0, 0] - 0.5 * side).astype(int)
        tracker.init(cv2.cvtColor(clip.images[0], cv2.COLOR_GRAY2BGR), (*corner.tolist(), side, side))
        for k, image in enumerate(clip.images[1:], start=1):
            found, (u, v, width, height) = tracker.update(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR))
            yield k, [np.array([u + 0.5 * (width - 1), v + 0.5 * (height - 1)]) if found else None], [found]

    return tracked


FOLLOWED_BY = {"track": follow, "MOG2": largest_contour} | {name: of_opencv(name) for name in OPENCV}


def installed(cells):
    """Returns the cells whose tracker this OpenCV has."""
    has = {name: hasattr(module, kind) for name, (module, kind) in OPENCV.items()}
    missing = [name for name in OPENCV if not has[name]]
    if missing:
        print(f"not in this OpenCV: {', '.join(missing)}", flush=True)
    return [cell for cell in cells if has.get(CELLS[cell][1], True)]


def distance(place, true):
    """Returns the distance of a place, or None, from the true one [px]."""
    return np.inf if place is None else float(np.hypot(*(place - true)))


def installed_with_photographs(cells):
    """Returns the same, or no cells without the package that has the photographs."""
    if not footage_photographs.available():
        print("the photographs are in scikit-image, which is not installed", flush=True)
        return []
    return installed(cells)


def photographed_job(cell, seed, quick):
    """Returns the line of a clip before a photograph."""
    kind, method = PHOTOGRAPHED[cell]
    return measured(footage_photographs.make_photographed(kind, seed), kind, method)


def job(cell, seed, quick):
    """Returns the line of a clip, see `measured`."""
    kind, method = CELLS[cell]
    return measured(make_clip(kind, seed), kind, method)


def measured(clip, kind, method):
    """Returns the line of a clip: errors [px] of one object, and whether two that crossed kept their identities.

    Of two objects that cross, a tracker of OpenCV follows the first, MOG2 finds whichever is larger, and `track` both.
    """
    errors, missed, owners = [], 0, []
    for k, places, seen in FOLLOWED_BY[method](clip, kind):
        if k < FIRST:
            continue
        off = [[distance(place, true) for true in clip.truth[k]] for place in places]
        if kind == "crossing" and method == "track":
            if all(seen):
                owners.append([int(np.argmin(row)) for row in off])
            errors += [min(row) for row, is_seen in zip(off, seen) if is_seen]
            missed += sum(not is_seen for is_seen in seen)
        elif places[0] is None:
            missed += 1
        else:
            errors.append(off[0][0] if kind != "crossing" or method in OPENCV else min(off[0]))
    kept = bool(owners) and owners[0] == owners[-1] and len(set(owners[0])) == 2
    return {"errors_px": errors, "missed": missed, "size_px": clip.size, "kept": kept if owners else None}


def summary(rows):
    """Returns the results of a cell."""
    errors = np.concatenate([row["errors_px"] for row in rows])
    limits = np.concatenate([np.full(len(row["errors_px"]), max(WRONG, 0.5 * row["size_px"])) for row in rows])
    described = len(errors) + sum(row["missed"] for row in rows)
    known = [row["kept"] for row in rows if row["kept"] is not None]
    return {
        "clips": len(rows),
        "images": described,
        "median_px": float(np.median(errors)) if len(errors) else None,
        "p95_px": float(np.percentile(errors, 95)) if len(errors) else None,
        "wrong": float(np.mean(errors > limits)) if len(errors) else None,
        "missed": (described - len(errors)) / described,
        "kept": sum(known) if known else None,
        "kept_wilson": wilson(sum(known), len(known)) if known else None,
    }


def decoding(paths, count):
    """Returns the images or pairs per second that decoding the files and making them grey allows, without a thread."""
    began = time.perf_counter()
    for path in paths:
        with av.open(str(path)) as container:
            for frame in container.decode(video=0):
                cv2.cvtColor(frame.to_ndarray(format="rgb24"), cv2.COLOR_RGB2GRAY)
    return count / (time.perf_counter() - began)


def speed(seed, quick):
    """Returns images or pairs per second of the whole command, with start and files, and of decoding alone.

    One camera has 900 and 1800 images of 640 x 480 px, two have 300 each of 1088 x 1920 px. The modules are compiled
    beforehand, as `make setup` does and as Python's first start would.
    """
    cells = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        commands = []
        clip = make_clip("plain", seed, 60 if quick else 1800)
        for count in (len(clip.images) // 2, len(clip.images)):
            footage_files.write(folder / f"{count}.mp4", footage_files.FILES["H.264 in MP4"], clip.images[:count], None)
            commands.append((f"{count} images of 640 x 480 px", [f"{count}.mp4"], count))
        pairs = 30 if quick else 300
        footage_stereo.write_pair(folder, seed, pairs)
        commands.append((STEREO, ["left.mp4", "right.mp4", "--calibration", "stereo.yaml"], pairs))
        subprocess.run([sys.executable, "-m", "compileall", "-q", PACKAGE], check=True)
        for label, sources, count in commands:
            rate = decoding([folder / each for each in sources if each.endswith(".mp4")], count)
            cells.append({"cell": f"{label}, {DECODING}", "images_per_s": rate})
            for overlay, more in (("with overlay", []), ("--no-overlay", ["--no-overlay"])):
                command = [sys.executable, "-m", "drake_tracker", "track", *sources, "--out", label + overlay, *more]
                began = time.perf_counter()
                subprocess.run(command, check=True, stdout=subprocess.DEVNULL, cwd=folder)
                rate = count / (time.perf_counter() - began)
                cells.append({"cell": f"{label}, {overlay}", "images_per_s": rate})
    return cells


FIRST_SEED, CLIPS, CROSSINGS = 7640, 12, 40
COUNTS = {cell: CROSSINGS if cell == "crossing: track" else CLIPS for cell in CELLS}
PARTS = {
    "accuracy": Part(job, COUNTS, FIRST_SEED, summary, TABLES["accuracy"], installed),
    "photographs": Part(
        photographed_job,
        dict.fromkeys(PHOTOGRAPHED, CLIPS),
        FIRST_SEED,
        summary,
        TABLES["photographs"],
        installed_with_photographs,
    ),
    "files": Part(
        footage_files.job, dict.fromkeys(footage_files.FILES, 5), FIRST_SEED, footage_files.summary, TABLES["files"]
    ),
    "fast": Part(footage_fast.job, dict.fromkeys(footage_fast.CELLS, 40), FIRST_SEED, summary, TABLES["fast"]),
    "hidden": Part(footage_hidden.job, dict.fromkeys(footage_hidden.CELLS, 40), FIRST_SEED, summary, TABLES["hidden"]),
    "person": Part(
        footage_person.job,
        dict.fromkeys(footage_person.CELLS, 12),
        FIRST_SEED,
        footage_person.summary,
        TABLES["person"],
    ),
    "several": Part(
        footage_several.job,
        {"crossing": 40, "alike": 40, "behind a post": 12, "one camera": 12},
        FIRST_SEED,
        footage_several.summary,
        TABLES["several"],
    ),
    "speed": Timed(speed, FIRST_SEED, TABLES["speed"]),
}

if __name__ == "__main__":
    parts.main(__doc__, PARTS, FOLDER, RESULTS)
