"""What is measured of tracks beside the truth: arithmetic on the arrays of a `several_worlds.Record`."""

import numpy as np
from scipy.optimize import linear_sum_assignment

NEAR = 0.015
"""Largest horizontal distance of a point from the centre of its object [m]."""
MARGIN = 0.010
"""A point lies on a train up to this distance outside its outline [m]."""
SAME = 0.060
"""Largest horizontal distance at which a track counts as that of an object [m]."""
WIDTH = 0.040
PLACES = 24
"""Places on a lap, equally spaced."""
WRONG = 6.0
"""Distance from the truth [px] from which a valid centroid is wrong."""
RESAMPLES = 1000
_FAR = 1e6


def assigned(record, limit):
    """Returns the slot of the track of each object, shape (n, m), -1 without one within ``limit`` [m], horizontally.

    The sum of the distances is the least, and no two objects share a track. Only tracks that were measured count.
    """
    distances = np.linalg.norm(record.points[:, None, :, :2] - record.p_WO[:, :, None, :2], axis=3)
    cost = np.where((record.numbers[:, None, :] > 0) & (distances <= limit), distances, _FAR)
    slots = np.full(cost.shape[:2], -1)
    for row, table in zip(slots, cost):
        for i, j in zip(*linear_sum_assignment(table)):
            if table[i, j] < _FAR:
                row[i] = j
    return slots


def on_trains(record, lengths):
    """Returns whether each point lies on a train, shape (n, k): within its outline and `MARGIN`."""
    offset = record.points[:, None, :, :2] - record.p_WO[:, :, None, :2]
    c, s = np.cos(record.yaw)[..., None], np.sin(record.yaw)[..., None]
    along = np.abs(c * offset[..., 0] + s * offset[..., 1])
    across = np.abs(c * offset[..., 1] - s * offset[..., 0])
    half = 0.5 * np.asarray(lengths)[None, :, None]
    return ((along <= half + MARGIN) & (across <= 0.5 * WIDTH + MARGIN)).any(axis=1)


def separation_numbers(record, lengths, start, lap):
    """Returns what one part of a run says about how well the objects are separated.

    Args:
        record: the images of whole laps.
        lengths: of the trains [m].
        start: time at which the laps begin [s].
        lap: time of a lap [s].

    Returns a dict: ``images``; ``both``, those in which every train has its own point within `NEAR`; ``one``, those in
    which a point is within `NEAR` of any train; ``places`` and ``good_places``, those in most of whose images every
    train has its point; ``valid``, the number of points; ``neither``, those on no train.
    """
    slots = assigned(record, NEAR)
    both = (slots >= 0).all(axis=1)
    place = np.floor(PLACES * (record.stamps - start) / lap).astype(int)
    shares = [np.mean(both[place == number]) for number in np.unique(place)]
    valid = record.numbers > 0
    return {
        "images": len(both),
        "both": int(both.sum()),
        "one": int((slots >= 0).any(axis=1).sum()),
        "places": len(shares),
        "good_places": int(np.sum(np.array(shares) >= 0.5)),
        "valid": int(valid.sum()),
        "neither": int((valid & ~on_trains(record, lengths)).sum()),
    }


def time_until_all(record):
    """Returns the first stamp at which every object has its own point within `NEAR` [s], None if there is none."""
    found = np.flatnonzero((assigned(record, NEAR) >= 0).all(axis=1))
    return float(record.stamps[found[0]]) if len(found) else None


def identity_numbers(record):
    """Returns how the identities of the objects change, from the first image in which each has a track of its own.

    Until then, objects that are merged may have a single track; whose it is cannot be said.

    Returns a dict: ``swaps``, how often an object takes over a number that another one had; ``begun_again``, how often
    it gets a number that no object had; ``lost``, how often a track that an object had is deleted.
    """
    slots = assigned(record, SAME)
    begin = int((slots >= 0).all(axis=1).argmax())
    owner: dict[int, int] = {}
    current = [0] * slots.shape[1]
    swaps = begun_again = lost = 0
    before: set[int] = set()
    for row, numbers, alive in zip(slots[begin:], record.numbers[begin:], record.alive[begin:]):
        for thing, slot in enumerate(row):
            number = int(numbers[slot]) if slot >= 0 else 0
            if number in (0, current[thing]):
                continue
            if owner.get(number, thing) != thing:
                swaps += 1
            elif current[thing] and number not in owner:
                begun_again += 1
            current[thing], owner[number] = number, thing
        now = {int(number) for number in alive if number}
        lost += len((before - now) & set(owner))
        before = now
    return {"swaps": swaps, "begun_again": begun_again, "lost": lost}


def errors_in_std(record, trains):
    """Returns the errors of all measured points in standard deviations, and in metres, each shape (n, 3).

    Args:
        record: the images.
        trains: how many of the objects are trains, from the first on; the points of others do not count.

    Returns (errors / reported standard deviation, errors [m], number of points that belong to no object).
    """
    slots = assigned(record, SAME)
    images, things = np.nonzero(slots[:, :trains] >= 0)
    chosen = slots[images, things]
    errors = record.points[images, chosen] - record.p_WO[images, things]
    std = np.sqrt(record.variances[images, chosen])
    strays = int((record.numbers > 0).sum() - (slots >= 0).sum())
    return errors / std, errors, strays


def coverage_numbers(runs):
    """Returns the share of the errors within one standard deviation: [value, lower, upper limit] per axis and pooled.

    The 95 % interval is from a bootstrap over the runs.

    Args:
        runs: errors in standard deviations, one array (n, 3) per run.
    """
    counts = np.array([np.append((np.abs(run) <= 1.0).sum(axis=0), len(run)) for run in runs], float)
    draws = np.random.default_rng(0).integers(len(runs), size=(RESAMPLES, len(runs)))
    totals = np.vstack([counts.sum(axis=0), counts[draws].sum(axis=1)])
    totals = totals[totals[:, 3] > 0]
    if not len(totals):
        return {}
    shares = np.column_stack([totals[:, :3] / totals[:, 3:], totals[:, :3].sum(axis=1) / (3.0 * totals[:, 3])])
    return {
        name: [float(values[0]), *(float(value) for value in np.percentile(values[1:], [2.5, 97.5]))]
        for name, values in zip((*"xyz", "all"), shares.T)
    }


def centroid_numbers(record, cameras):
    """Returns the error of the target's centroids beside the projected centre of the first train.

    Args:
        record: the images.
        cameras: the true left and right camera, as they stand without a fault.

    Returns a dict: ``centroids``, two for each pair of images; ``unusable``, the share of the pairs of which an image
    could not be used; ``invalid``, the share of the centroids that are not valid; ``median_px``, of the valid ones;
    ``wrong``, the share of all that are valid and off by more than `WRONG`.
    """
    errors, valid = [], []
    for side, camera in enumerate(cameras):
        truth = camera.project(record.p_WO[:, 0])
        errors.append(np.linalg.norm(record.centroids[:, side, :2] - truth, axis=1))
        valid.append(record.centroids[:, side, 2] > 0)
    errors, valid = np.concatenate(errors), np.concatenate(valid)
    return {
        "centroids": len(valid),
        "unusable": float(np.mean(~np.asarray(record.usable, bool))),
        "invalid": float(np.mean(~valid)),
        "median_px": float(np.median(errors[valid])) if valid.any() else None,
        "wrong": float(np.mean(valid & (errors > WRONG))),
    }
