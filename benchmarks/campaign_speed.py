"""Trials a minute of a campaign with measured vision, by one worker and by more: what the second core is worth.

    python benchmarks/campaign_speed.py                      20 trials by 1 worker and by 2, three turns of each
    python benchmarks/campaign_speed.py --trials 4 --turns 1 [--workers 1,2,4] [--json FILE]

The default train; all run the same seeds, and take turns. The time includes the start of the processes. Nothing else
should run meanwhile: what is compared uses one core and two.
"""

import argparse
import os
import statistics
import time

from common import print_table, save_json

from drake_tracker import run_campaign

FIRST_SEED = 500


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=20, help="of each turn")
    parser.add_argument("--turns", type=int, default=3)
    parser.add_argument("--workers", default="1,2", help="numbers separated by commas")
    parser.add_argument("--json", metavar="FILE")
    options = parser.parse_args()
    counts = [int(text) for text in options.workers.split(",")]
    rates = {count: [] for count in counts}
    load = []
    for _ in range(options.turns):
        for count in counts:
            load.append(os.getloadavg()[0])
            start = time.monotonic()
            campaign = run_campaign("train", options.trials, first_seed=FIRST_SEED, vision="measured", workers=count)
            rates[count].append(60.0 * len(campaign.rows) / (time.monotonic() - start))
    medians = {count: statistics.median(found) for count, found in rates.items()}
    first = medians[counts[0]]
    rows = [
        [count, f"{medians[count]:.1f}", f"{min(found):.1f}-{max(found):.1f}", f"{medians[count] / first:.2f}"]
        for count, found in rates.items()
    ]
    print_table(["workers", "trials a minute", "slowest and fastest turn", f"x {counts[0]} worker"], rows)
    print(f"{os.cpu_count()} cores; load before the turns: {', '.join(f'{value:.1f}' for value in load)}")
    save_json({"trials_a_minute": rates, "cores": os.cpu_count(), "load_before": load}, options.json)


if __name__ == "__main__":
    main()
