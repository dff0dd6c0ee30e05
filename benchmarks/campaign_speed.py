"""Measures the trials per minute of a campaign with measured vision, with one worker and with several.

    python benchmarks/campaign_speed.py                      20 trials with 1 worker and with 2, three turns each
    python benchmarks/campaign_speed.py --trials 4 --turns 1 [--workers 1,2,4] [--json FILE]

All run `train:learned` on the same seeds, in turns. The time includes the start of the processes. Run nothing else
meanwhile: one worker uses one core, two workers use two.
"""

import argparse
import os
import time

from result_tables.speed_tables import campaigns_table
from shared.common import print_table, save_json

from drake_tracker import run_campaign

FIRST_SEED = 500


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trials", type=int, default=20, help="trials per turn")
    parser.add_argument("--turns", type=int, default=3, help="turns of each number of workers")
    parser.add_argument("--workers", default="1,2", help="numbers separated by commas")
    parser.add_argument("--json", metavar="FILE", help="also write the results to FILE")
    options = parser.parse_args()
    counts = [int(text) for text in options.workers.split(",")]
    rates = {count: [] for count in counts}
    load = []
    for _ in range(options.turns):
        for count in counts:
            load.append(os.getloadavg()[0])
            start = time.monotonic()
            campaign = run_campaign(
                "train:learned", options.trials, first_seed=FIRST_SEED, vision="measured", workers=count
            )
            rates[count].append(60.0 * len(campaign.rows) / (time.monotonic() - start))
    results = {"trials_a_minute": rates, "cores": os.cpu_count(), "load_before": load, "trials": options.trials}
    print_table(*campaigns_table(results))
    print(f"{os.cpu_count()} cores; load before the turns: {', '.join(f'{value:.1f}' for value in load)}")
    save_json(results, options.json, range(FIRST_SEED, FIRST_SEED + options.trials))


if __name__ == "__main__":
    main()
