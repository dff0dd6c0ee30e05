"""The tables of `launches.py`."""

import math

import numpy as np
from shared.common import FEWEST, percent, share

from drake_tracker.campaign.rates import wilson

TENTHS = 10
"""Number of groups of the launches."""
TOLERANCE = 0.05
"""Difference of the share lifted from the mean probability up to which a group counts as right."""
GROUP_NAMES = {
    "learned": "`train:learned`, blind",
    "guided": "`train:guided`",
    "conveyor": "`conveyor:measured`",
}
PATHS = {"closed tracks": ("circle", "oval", "stadium"), "random walks": ("random_walk",)}
"""{what is said of them: kinds of track}."""


def pairs_of(rows):
    """Returns probability and outcome of each launch, shape (n, 2), ordered by probability, equal ones as measured."""
    found = [pair for row in rows for pair in row.get("descents", [])]
    found += [[row["probability"], row["lifted"]] for row in rows if row.get("probability") is not None]
    return np.array(sorted(found, key=lambda pair: pair[0]), dtype=float)


def tenths_of(rows):
    """Returns [launches, mean probability, lifted] of each of ten groups of equal size, ordered by probability."""
    groups = np.array_split(pairs_of(rows), TENTHS)
    return [[len(group), float(group[:, 0].mean()), int(group[:, 1].sum())] for group in groups]


def right(tenths):
    """Returns in how many groups the share lifted is within `TOLERANCE` of the mean probability."""
    return sum(abs(lifted / count - mean) <= TOLERANCE for count, mean, lifted in tenths)


def calibration_table(rows):
    """Returns (header, rows): per group the mean computed probability and the share lifted of each tenth of at least
    `FEWEST` launches."""
    header = ["scenario", "launches", *(f"tenth {k}" for k in range(1, TENTHS + 1)), "within 5 points"]
    found = []
    cells = [(name, [row for row in rows if row["group"] == group]) for group, name in GROUP_NAMES.items()]
    for path, kinds in PATHS.items():
        guided = [row for row in rows if row["group"] == "guided" and row.get("shape") in kinds]
        cells.append((f"`train:guided`, of these {path}", guided))
    for name, of_group in cells:
        if len(pairs_of(of_group)) < TENTHS * FEWEST:
            continue
        tenths = tenths_of(of_group)
        texts = [f"{100 * mean:.0f} / {100 * lifted / count:.0f}" for count, mean, lifted in tenths]
        found.append([name, sum(count for count, *_ in tenths), *texts, f"{right(tenths)} of {TENTHS}"])
    return header, found


def cameras_table(rows):
    """Returns (header, rows): mean probability and share lifted of each half of the launches with cameras."""
    header = ["scenario, half of the launches", "launches", "computed", "lifted", "Wilson 95 %", "computed within it"]
    found = []
    for group in dict.fromkeys(row["group"] for row in rows if row["group"].endswith("with cameras")):
        of_group = [row for row in rows if row["group"] == group]
        halves = np.array_split(pairs_of(of_group), 2)
        for name, half in zip(("lower", "upper"), halves):
            mean, lifted, count = float(half[:, 0].mean()), int(half[:, 1].sum()), len(half)
            low, high = wilson(lifted, count)
            text = f"`{of_group[0]['scenario']}`, {name}"
            right = "yes" if low <= mean <= high else "no"
            found.append([text, count, percent(mean), *share(lifted, count), right])
    return header, found


def threshold_table(rows):
    """Returns (header, rows): first attempts and times of the launches, over `grasp.launch_probability`."""
    header = ["path", "`launch_probability`", "runs", "lifted at the first attempt", "Wilson 95 %", "median launch"]
    found = []
    for path, shapes in PATHS.items():
        for group in sorted({row["group"] for row in rows if row["group"].startswith("from ")}):
            runs = [row for row in rows if row["group"] == group and row.get("shape") in shapes]
            times = sorted(math.inf if row["launch_s"] is None else row["launch_s"] for row in runs)
            first, median = sum(row["lifted"] for row in runs), times[len(times) // 2]
            late = "none" if median == math.inf else f"{median:.1f} s"
            found.append([path, group.split()[1], len(runs), *share(first, len(runs)), late])
    return header, found
