"""Measures how well `drake-tracker track` follows an object in image coordinates, beside OpenCV's MOG2 and MIL.

    python benchmarks/footage.py            all clips, on two processes; resumes
    python benchmarks/footage.py --quick    a trial on seeds of its own; nothing is written to the results

The clips are drawn (`footage_clips.py`), so that the true centre of every object is known: one object in front of a
textured scene at rest, with a camera that shakes or pans, beside a larger mover, a ball of 10 to 40 px at 2 to 40 px an
image, two objects that cross, and a walking figure. `track` gets the pixel of the object in the first image (beside the
larger mover, ``--follow``) or nothing, MIL the true rectangle in the first image, MOG2 nothing: the centroid of its
largest contour. Each describes every image after the first ten. A place is wrong when it is farther from the truth than
half of the object's size, and 10 px. CSRT, KCF and median flow are not in the package of OpenCV that the project uses.

Seeds 7600 to 7639 are used nowhere else.
"""

from pathlib import Path

import common
import cv2
import numpy as np
import parts
from footage_clips import KINDS, RATE, make_clip
from footage_tables import TABLES
from parts import Part

from drake_tracker.campaign.wilson import wilson
from drake_tracker.vision.config import NormalFlow
from drake_tracker.vision.image_track import TrackState
from drake_tracker.vision.image_tracker import ImageTracker
from drake_tracker.vision.normal_flow import NormalFlowDetector

RESULTS = common.RESULTS / "footage.json"
FOLDER = Path(__file__).resolve().parents[1] / "runs" / "footage"
FIRST = 10
"""Images at the beginning that do not count: every method needs some to learn the scene, or to find the object."""
WRONG = 10.0
"""See above [px]."""
METHODS = ("track", "MOG2", "MIL")
CELLS = {f"{kind}, {method}": (kind, method) for kind in KINDS for method in METHODS}


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
            seen = [track is not None and track.state != TrackState.HIDDEN for track in tracks]
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


def mil(clip, kind):
    """Yields the same of OpenCV's MIL tracker, which starts with the true rectangle."""
    cv2.setRNGSeed(0)
    tracker = cv2.TrackerMIL.create()
    side = round(clip.size)
    corner = np.rint(clip.truth[0, 0] - 0.5 * side).astype(int)
    tracker.init(cv2.cvtColor(clip.images[0], cv2.COLOR_GRAY2BGR), (*corner.tolist(), side, side))
    for k, image in enumerate(clip.images[1:], start=1):
        found, (u, v, width, height) = tracker.update(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR))
        yield k, [np.array([u + 0.5 * (width - 1), v + 0.5 * (height - 1)]) if found else None], [found]


FOLLOWED_BY = {"track": follow, "MOG2": largest_contour, "MIL": mil}


def distance(place, true):
    """Returns the distance of a place, or None, from the true one [px]."""
    return np.inf if place is None else float(np.hypot(*(place - true)))


def job(cell, seed, quick):
    """Returns the line of a clip: errors [px] of one object, and whether two that crossed kept their identities.

    Of two objects that cross, MIL follows the first, MOG2 finds whichever is larger, and `track` both.
    """
    kind, method = CELLS[cell]
    clip = make_clip(kind, seed)
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
            errors.append(off[0][0] if kind != "crossing" or method == "MIL" else min(off[0]))
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


PARTS = {"accuracy": Part(job, dict.fromkeys(CELLS, 40), 7600, summary, TABLES["accuracy"])}

if __name__ == "__main__":
    parts.main(__doc__, PARTS, FOLDER, RESULTS)
