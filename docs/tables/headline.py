"""The tables of the front page: the ladder of the train's scenarios, and results of the other parts."""

import statistics
from collections import Counter

from ball import lags
from result_tables.autopsy_tables import totals
from result_tables.law_tables import TOLERANCE, within
from shared.behaviour_rows import other_behaviours
from shared.common import interval
from train_grasp import (
    BY_NAME,
    CELLS,
    FIRST_SEED,
    ITSELF,
    OTHERS,
    RUNGS,
    SEEDS,
    is_rung,
    lifted,
    median_time,
    touch_error,
)

from tables.results import Row, block, data, lines, origin, seeds_between, table, uses, where

CONDITIONS = [cell for cell in CELLS if cell not in BY_NAME]
"""Cells in which each rung is run."""
_CONDITIONS, _SEEDS = CONDITIONS.__contains__, seeds_between(FIRST_SEED, FIRST_SEED + SEEDS - 1)
_ADDS = {
    "train": "the system of 1991: motion centroid, arc-length filter, blind descent",
    "train:learned": "the filter learns the closed path from a lap",
    "train:guided": "vision of several objects, which guides the hand until contact",
    "train:wrist": "a camera on the hand",
    "train:two": "a second train beside the target",
    "train:visitor": "a ball beside the track",
}
"""{scenario of the ladder: what it adds}; the last two rest on `train:learned`."""


def rung_rows(scenario: str) -> list[Row]:
    """Returns the runs of a scenario that the ladder rests on.

    Of a rung, these are all conditions with the seeds that each rung has run in each condition. Other scenarios run as
    they are.
    """
    if scenario in OTHERS:
        return where(lines("train_grasp"), scenario=scenario, cell=ITSELF)
    rows = [row for row in where(lines("train_grasp"), seed=_SEEDS, cell=_CONDITIONS) if is_rung(row)]
    runs = Counter(row["seed"] for row in rows)
    return [row for row in where(rows, scenario=scenario) if runs[row["seed"]] == len(RUNGS) * len(CONDITIONS)]


def ladder() -> str:
    speed = data("real_time")
    outdated = other_behaviours(speed)
    rows, used = [], []
    for scenario in _ADDS:
        runs = rung_rows(scenario)
        if not runs:
            continue
        _, first = lifted(runs)
        errors = [touch_error(row) for row in runs if row["success"]]
        factor = speed["loops"]["whole, one process" if scenario == "train" else scenario]["real_time_factor"]
        conditions = len({row["cell"] for row in runs})
        rows.append(
            [
                f"`{scenario}`",
                _ADDS[scenario],
                f"{first} of {len(runs)}" + (f" in {conditions} conditions" if conditions > 1 else ""),
                interval(first, len(runs)),
                median_time(runs),
                f"{1e3 * statistics.median(errors):.0f} mm",
                "" if scenario in outdated else f"{factor:.2f}",
            ]
        )
        used += runs
    uses(*used)
    header = ["scenario", "what it adds", "lifted at the first attempt", "95 % interval", "median time to the grasp"]
    factor = f"real-time factor (bare physics: {speed['loops']['physics']['real_time_factor']:.1f})"
    return block(table([*header, "median error at the touch", factor], rows), origin(used))


def headline() -> str:
    balls = {arm: where(lines("ball"), cell=arm) for arm in ("puma", "seven_joint")}
    trains = [row for scenario in RUNGS for row in rung_rows(scenario)]
    train_lags = sorted({1e3 * row["lag_s"][end] for row in trains for end in ("min", "max")})
    autopsies = lines("autopsy")
    uses(*balls["puma"], *balls["seven_joint"], *trains, *autopsies)
    _, failed, named = totals(autopsies)
    law = where(lines("success_law"), part="cells")
    uses(*law)
    (right, _, cells), limit = within(law), 100.0 * TOLERANCE
    rows = [
        ["Ball caught, PUMA 560 (`ball`)", *_successes(balls["puma"])],
        ["Ball caught, seven-joint arm (`ball:seven_joint`)", *_successes(balls["seven_joint"])],
        [
            "Time from image to prediction",
            f"train {_ms(train_lags)}, ball {_ms(lags(balls['puma'] + balls['seven_joint']))}",
            "identical in every run",
        ],
        ["Autopsy names the injected fault of a failed run (`train:learned`)", *_rate(named, failed)],
        ["`predict-success` on 12 unseen cells", f"{right} of {cells} within {limit:.0f} points", ""],
    ]
    return table(["measurement", "result", "95 % interval"], rows)


def _rate(count: int, total: int) -> list[str]:
    return [f"{count} of {total}", interval(count, total)]


def _successes(rows: list[Row]) -> list[str]:
    return _rate(sum(bool(row["success"]) for row in rows), len(rows))


def _ms(values: list[float]) -> str:
    return "/".join(f"{value:.2f}" for value in values) + " ms"
