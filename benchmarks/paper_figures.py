"""The numbers of figures 7, 12 and 15 of Allen et al. 1991, on several seeds.

    OPENBLAS_NUM_THREADS=1 python benchmarks/paper_figures.py [--seeds N] [--json FILE]

Each seed is a tracking run of three laps with cameras (`drake_tracker/figures/loop_runs.py`), half a minute long.
"""

import argparse
import tempfile
from pathlib import Path

from shared.common import print_table, save_json

from drake_tracker.figures import loop_runs
from drake_tracker.figures.command import rounded
from drake_tracker.figures.curvature import curvature_limit
from drake_tracker.figures.measured_arc import filtered_arc, measured_density

FIRST_SEED = 9100


def scalars(numbers):
    """Returns the entries of a figure's numbers that are no samples."""
    return {name: value for name, value in rounded(numbers).items() if not isinstance(value, list)}


def measure(seed):
    """Returns the numbers of figures 7 and 12 for the run of a seed."""
    scenario, _ = loop_runs.tracking_scenario(seed)
    with tempfile.TemporaryDirectory() as folder:
        log, _ = loop_runs.record(scenario, Path(folder) / "run", stop=False)
    return {"seed": seed, "figure_07": scalars(measured_density(log)), "figure_12": scalars(filtered_arc(log))}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=5, metavar="N", help="number of runs (default: 5)")
    parser.add_argument("--json", metavar="FILE", type=Path, help="also write the results to FILE")
    options = parser.parse_args()
    seeds = range(FIRST_SEED, FIRST_SEED + options.seeds)
    runs = [measure(seed) for seed in seeds]
    limit = curvature_limit()
    error = dict(zip(rounded(limit["interval_s"]), rounded(limit["relative_error"])))
    header = ["seed", "correlation", "Kolmogorov-Smirnov distance", "bias of s_1", "bias of s_0"]
    rows = [
        [
            run["seed"],
            f"{run['figure_07']['jitter_correlation']['coefficient']:+.2f}",
            f"{run['figure_07']['kolmogorov_smirnov']:.3f}",
            *(f"{100 * run['figure_12'][name]:+.1f} %" for name in ("bias_s_1", "bias_s_0")),
        ]
        for run in runs
    ]
    print_table(header, rows)
    save_json({"runs": runs, "figure_15_error_at_a_cycle": next(iter(error.values()))}, options.json, seeds)


if __name__ == "__main__":
    main()
