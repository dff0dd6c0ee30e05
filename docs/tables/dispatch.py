"""Dispatchers on random arrivals, without physics (`results/dispatch.json`)."""

from dispatch import FIRST_SEED

from tables.results import Row, block, data, ranges, table

_FIFO = "first_in_first_out"
_PATTERNS = {1: "independent"}
_SHOWN = ("look_ahead", "greedy", "nearest_deadline", _FIFO, "clairvoyant")


def dispatch_rules() -> str:
    results = data("dispatch")
    rows = []
    for case in results["cases"]:
        rate = case["per_minute"]
        share = [100.0 * value for value in case["of_clairvoyant"]["look_ahead"]]
        gain = [100.0 * (value - 1.0) for value in case["of_first_in_first_out"]["look_ahead"]]
        rows.append(
            [
                f"{case['speed']:.2f} m/s",
                _PATTERNS.get(case["bunch"], f"bunches of {case['bunch']}"),
                *(f"{rate[name][0]:.1f}" for name in _SHOWN),
                "{:.1f} % ({:.1f} to {:.1f})".format(*share),
                "{:+.1f} % ({:.1f} to {:.1f})".format(*gain),
            ]
        )
    header = [
        *("belt", "arrivals", "look ahead", "greedy", "nearest deadline", "first in first out", "clairvoyant"),
        *("look ahead / clairvoyant", "look ahead over first in first out"),
    ]
    made_by = results["made_by"]
    return block(
        table(header, rows),
        f"*Seeds {ranges(made_by['seeds'])}, commit `{made_by['commit'][:7]}`. The settings were chosen on seeds below "
        f"{FIRST_SEED}. The search of the clairvoyant was exact in {_exact(results)}.*",
    )


def dispatch_loads() -> str:
    results = data("dispatch")
    rows = [
        [
            f"{case['length']:.2f} m",
            case["pattern"],
            f"{100.0 * case['load']:.0f} %",
            f"{case['per_minute']:.1f}",
            *(
                "{:.1f} % ({:.1f} to {:.1f})".format(*(100.0 * value for value in case["missed"][name]))
                for name in ("look_ahead", "greedy", _FIFO, "clairvoyant")
            ),
        ]
        for case in results["loads"]
    ]
    header = ["window", "arrivals", "load", "parts a minute", "missed: look ahead", "greedy", "first in first out"]
    made_by = results["made_by"]
    return block(
        table([*header, "clairvoyant, at least"], rows),
        f"*Seeds {ranges(made_by['seeds'])}, commit `{made_by['commit'][:7]}`.*",
    )


def _exact(results: Row) -> str:
    cases = results["cases"]
    return f"{sum(case['exact_bounds'] for case in cases)} of {len(cases) * len(results['made_by']['seeds'])} runs"
