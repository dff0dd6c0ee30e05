"""The table of the front page."""

from autopsy_tables import totals
from ball import lags
from common import interval

from tables.results import data, lines, seeds_between, table, where
from tables.vision import compared

_CELL = {"cell": "stadium-white-1-constant", "stage": "after", "horizon": "grasp"}


def headline() -> str:
    trains = where(lines("train_grasp"), estimator="closed_path", seed=seeds_between(500, 523))
    trains = [row for row in trains if not row["cell"].startswith("cast-shadows")]
    measured = where(compared(500, 523), estimator="closed_path", cell="all")[0]
    balls = {arm: where(lines("ball"), cell=arm) for arm in ("puma", "seven_joint")}
    error, error_1991 = (
        where(data("estimation")["table"], contestant=name, **_CELL)[0] for name in ("closed_path", "arc_length")
    )
    train_lags = sorted({1e3 * row["lag_s"][end] for row in trains for end in ("min", "max")})
    factors = {name: row["real_time_factor"] for name, row in data("real_time")["loops"].items()}
    lifted = next(part for part in data("several") if part["part"] == "lift")
    company = [cell for cell in lifted["cells"] if cell["cell"] in ("two", "visitor")]
    _, failed, named = totals(lines("autopsy"))
    rows = [
        [
            f"Train lifted at the first attempt, rendered cameras, {len({row['cell'] for row in trains})} conditions"
            " without cast shadows",
            *_rate(sum(bool(row["first_attempt_success"]) for row in trains), len(trains)),
        ],
        [
            "The same on measured vision (no rendering), 12 conditions",
            *_rate(measured["measured_first_attempt_success_count"], measured["runs"]),
        ],
        [
            "One of two trains, or a train beside a rolling ball, lifted at the first attempt (`!Several`)",
            *_rate(sum(cell["first_attempt"] for cell in company), sum(cell["runs"] for cell in company)),
        ],
        ["Ball caught, PUMA 560", *_successes(balls["puma"])],
        ["Ball caught, seven-joint arm", *_successes(balls["seven_joint"])],
        [
            "Prediction error 0.75 s ahead, rms, synthetic world with 1 mm of noise",
            f"{error['rms_mm']:.2f} mm (filter of 1991: {error_1991['rms_mm']:.1f} mm)",
            "{:.2f}-{:.2f} mm ({:.1f}-{:.1f} mm)".format(*error["rms_mm_interval"], *error_1991["rms_mm_interval"]),
        ],
        [
            "Time from image to prediction",
            f"train {_ms(train_lags)}, ball {_ms(lags(balls['puma'] + balls['seven_joint']))}",
            "identical in every run",
        ],
        [
            "Real-time factor with cameras, two cores, no GPU",
            f"{factors['whole, one process']:.2f} (rendered in process: {factors['whole, in process']:.2f})",
            "",
        ],
        ["Autopsy names the injected fault of a failed run", *_rate(named, failed)],
    ]
    return table(["measurement", "result", "95 % interval"], rows)


def _rate(count: int, total: int) -> list[str]:
    return [f"{count} of {total}", interval(count, total)]


def _successes(rows: list[dict]) -> list[str]:
    return _rate(sum(bool(row["success"]) for row in rows), len(rows))


def _ms(values: list[float]) -> str:
    return "/".join(f"{value:.2f}" for value in values) + " ms"
