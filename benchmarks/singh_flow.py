"""Does Singh's image flow give the centroid of the train a better position, or an honest covariance?

    python benchmarks/singh_flow.py [--quick] [--seeds 700,701] [--time] [--json FILE]

Allen et al. (1991) compute normal flow and name Singh's estimation-theoretic framework as their plan: it estimates the
velocity of each pixel with a covariance (`singh_method`). This experiment takes one lap of `train:learned`
per seed, as the left camera sees it with the arm at rest. Both methods see the same three images at every position.

- normal flow: the package's detector with its defaults, with the centroid of the hull and of the moving pixels;
- conservation, both steps: Singh's flow without and with the neighbourhood step. A pixel counts with the probability
  that it moves faster than the threshold of normal flow, if that is at least `LEAST_PROBABILITY`. The centroid is that
  of these probabilities (mean) or of the hull of these pixels;
- coverage: the share of errors, u and v each, within one standard deviation of the propagated covariance; it should be
  68 %. The hull has the covariance of the mean;
- rank correlation: Spearman's, between the size of an error, u and v each, and its standard deviation: whether the
  covariance tells good images from bad ones;
- noise: standard deviation of the centroid with other noise in the same images, from pairs of draws (by the median);
- without the bias by heading: rms error after subtraction of the mean error of the other laps at the same heading.

Errors are those of u and v to the image of the train's centre. Intervals are 95 %, from a bootstrap over the laps.
`SHARPNESS` and `LEAST_PROBABILITY` were chosen on seeds 100 and 101. With ``--time`` the time per image is printed; it
is not part of the results.
"""

import argparse
import time
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from methods.singh_method import centroid, conservation, moving_probability, neighbourhood
from scipy.stats import spearmanr
from shared import rendered_images as rendered
from shared.common import print_table, save_json

from drake_tracker.vision.centroid.config import NormalFlow
from drake_tracker.vision.centroid.normal_flow import NormalFlowDetector
from drake_tracker.vision.region_centroid import hull_centroid, mean_centroid

SEEDS = tuple(range(700, 712))
EVERY = 8
"""Images from one position to the next."""
SHARPNESS = 1.0 / 800.0
"""k of the weights exp(-k SSD) [1/grey^2]."""
LEAST_PROBABILITY = 0.5
BORDER = 6
"""Pixels around the window that the SSD needs."""
HEADINGS = 12
"""Bins of the heading."""
OTHER_NOISE = 10_000
"""Added to the seed for the second draw of the noise."""
RESAMPLES = 2000
NORMAL_HULL, NORMAL_MEAN = "normal flow, hull (default)", "normal flow, mean"
METHODS = (
    *(NORMAL_HULL, NORMAL_MEAN),
    *("conservation, hull", "conservation, mean", "both steps, hull", "both steps, mean"),
)


class Camera:
    """Finds the train in images of one lap, by all methods.

    Attributes:
        seconds: {name: time of each image [s]} of normal flow and of the two variants of Singh's flow.
    """

    def __init__(self, seed):
        self._window = rendered.train_window(seed)
        self._detector = NormalFlowDetector(NormalFlow(), window=self._window)
        parameters = self._detector.parameters
        self.stride, self._join_distance = parameters.stride, parameters.join_distance
        self._threshold = parameters.displacement_threshold / 2
        self._mask_size = (parameters.smoothing_size, parameters.smoothing_size), parameters.smoothing_sigma
        u0, v0, width, height = cv2.boundingRect(self._window)
        height_full, width_full = self._window.shape
        self._first = np.array([max(0, u0 - BORDER), max(0, v0 - BORDER)])
        end = min(width_full, u0 + width + BORDER), min(height_full, v0 + height + BORDER)
        self._crop = np.s_[self._first[1] : end[1], self._first[0] : end[0]]
        self.seconds = {"normal flow": [], "conservation": [], "both steps": []}

    def found(self, images):
        """Returns rows (6, 4) of `METHODS`: centroid (u, v) and its standard deviations [px], NaN where there is none.

        Args:
            images: three grey images, `stride` cycles apart.
        """
        start = time.perf_counter()
        mask = self._detector.mask(*map(self._detector.smooth, images))
        hull = hull_centroid(mask, self._join_distance)
        self.seconds["normal flow"].append(time.perf_counter() - start)
        rows = [_row(hull), _row(mean_centroid(mask))]
        start = time.perf_counter()
        size, sigma = self._mask_size
        smooth = [cv2.GaussianBlur(image[self._crop].astype(np.float32), size, sigma) for image in images]
        flow = conservation(smooth, SHARPNESS)
        first = self._centroids(flow)
        self.seconds["conservation"].append(time.perf_counter() - start)
        second = self._centroids(neighbourhood(flow))
        self.seconds["both steps"].append(time.perf_counter() - start)
        return np.array([*rows, *first, *second])

    def _centroids(self, flow):
        """Returns the rows of hull and mean of a `Flow`."""
        probability = moving_probability(flow, self._threshold)
        counts = (probability >= LEAST_PROBABILITY) & (self._window[self._crop] > 0)
        found = centroid(np.where(counts, probability, 0.0))
        if found is None:
            return [_row(None)] * 2
        std = np.sqrt(np.diag(found.covariance))
        hull = _row(hull_centroid(255 * counts.astype(np.uint8), self._join_distance))[:2] + self._first
        return [np.append(hull, std), np.append(found.uv + self._first, std)]


def _row(region):
    return np.full(4, np.nan) if region is None else np.array([region.u, region.v, np.nan, np.nan])


def lap(seed, laps):
    """Returns the measurements of a lap.

    Returns (errors (2, n, 6, 2) [px] with two draws of the noise, standard deviations (n, 6, 2) [px], headings (n,)
    [rad], {name: times [s]}).
    """
    sequence = rendered.train_sequence(seed, laps)
    camera = Camera(seed)
    stride = camera.stride
    chosen = [k for k in np.flatnonzero(sequence.moving) if stride <= k < len(sequence.images) - stride][::EVERY]
    draws = []
    for own in (seed, seed + OTHER_NOISE):
        images, _, _ = rendered.seen(replace(sequence, seed=own))
        draws.append([camera.found([images[k + step] for step in (-stride, 0, stride)]) for k in chosen])
    found = np.array(draws)
    errors = found[..., :2] - sequence.uv[chosen][:, None]
    velocity = np.gradient(sequence.p_WQ[:, :2], axis=0)[chosen]
    return errors, found[0, ..., 2:], np.arctan2(velocity[:, 1], velocity[:, 0]), camera.seconds


def numbers(laps):
    """Returns {method: numbers} of what `lap` returned for each lap."""
    table = {}
    for index, name in enumerate(METHODS):
        errors = [part[0][:, :, index] for part in laps]
        stds = [part[1][:, index] for part in laps]
        first = [part[0] for part in errors]
        sizes = [np.hypot(*part.T) for part in first]
        noise = np.concatenate([part[0] - part[1] for part in errors]) / np.sqrt(2.0)
        row = {
            "images": int(sum(map(len, sizes))),
            "valid": float(np.isfinite(np.concatenate(sizes)).mean()),
            "median_px": _with_interval(sizes, np.nanmedian),
            "rms_axis_px": _rms(np.concatenate(first)),
            "noise_axis_px": float(1.4826 * np.nanmedian(np.abs(noise))),
            "rms_without_bias_px": _rms(without_bias(first, [part[2] for part in laps])),
        }
        if np.isfinite(np.concatenate(stds)).any():
            within = [(np.abs(error) <= std)[np.isfinite(error)].astype(float) for error, std in zip(first, stds)]
            row["coverage"] = _with_interval(within, np.mean)
            row["rank_correlation"] = _rank_correlation(np.abs(np.concatenate(first)), np.concatenate(stds))
            row["std_axis_px"] = float(np.nanmedian(np.concatenate(stds)))
        table[name] = row
    return table


def without_bias(errors, headings):
    """Returns the errors (n, 2) less the mean error of the other laps at the same heading, where there is one."""
    bins = [np.floor(HEADINGS * (heading / (2.0 * np.pi) + 0.5)).astype(int) % HEADINGS for heading in headings]
    left = []
    for k, (own, own_bins) in enumerate(zip(errors, bins)):
        others = np.concatenate([part for j, part in enumerate(errors) if j != k] or [own[:0]])
        other_bins = np.concatenate([part for j, part in enumerate(bins) if j != k] or [own_bins[:0]])
        for number in np.intersect1d(own_bins, other_bins):
            left.append(own[own_bins == number] - np.nanmean(others[other_bins == number], axis=0))
    return np.concatenate(left) if left else np.empty((0, 2))


def _with_interval(parts, statistic):
    """Returns [statistic of all values, lower and upper limit of its 95 % interval] from a bootstrap over the parts."""
    rng = np.random.default_rng(0)
    draws = rng.integers(len(parts), size=(RESAMPLES, len(parts)))
    values = [statistic(np.concatenate([parts[k] for k in draw])) for draw in draws]
    return [float(value) for value in (statistic(np.concatenate(parts)), *np.percentile(values, [2.5, 97.5]))]


def _rank_correlation(a, b):
    both = np.isfinite(a) & np.isfinite(b)
    return float(spearmanr(a[both], b[both]).statistic)


def _rms(values):
    return float(np.sqrt(np.nanmean(np.square(values)))) if np.isfinite(values).any() else None


def methods_table(found):
    """Returns (header, rows) of what `numbers` returned."""
    rows = []
    for name, row in found.items():
        median = "{:.2f} ({:.2f}-{:.2f})".format(*row["median_px"])
        coverage = std = correlation = ""
        if "coverage" in row:
            coverage = "{:.0f} % ({:.0f}-{:.0f})".format(*(100 * value for value in row["coverage"]))
            std, correlation = f"{row['std_axis_px']:.2f}", f"{row['rank_correlation']:+.2f}"
        others = [row[key] for key in ("noise_axis_px", "rms_axis_px", "rms_without_bias_px")]
        rows.append(
            [name, median, coverage, std, correlation, *("" if value is None else f"{value:.2f}" for value in others)]
        )
    header = ["centroid", "median error [px]", "errors within one standard deviation", "standard deviation [px]"]
    return [*header, "rank correlation", "noise [px]", "rms error [px]", "without the bias by heading [px]"], rows


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", help=f"laps, separated by commas (default {SEEDS[0]} to {SEEDS[-1]})")
    parser.add_argument("--quick", action="store_true", help="a quarter of a lap on two seeds")
    parser.add_argument("--time", action="store_true", help="print the time per image")
    parser.add_argument("--json", metavar="FILE", type=Path, help="also write the results to FILE")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    seeds = [int(text) for text in options.seeds.split(",")] if options.seeds else list(SEEDS)
    seeds = seeds[:2] if options.quick else seeds
    laps = [lap(seed, 0.25 if options.quick else 1.0) for seed in seeds]
    found = numbers(laps)
    print_table(*methods_table(found))
    if options.time:
        for name in laps[0][3]:
            milliseconds = 1e3 * np.median(np.concatenate([part[3][name] for part in laps]))
            print(f"{name}: {milliseconds:.2f} ms per image")
    save_json({"methods": found}, options.json, seeds)


if __name__ == "__main__":
    main()
