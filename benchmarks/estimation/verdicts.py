"""The numbers that were asked for before they were measured, each with what was found and whether it is met."""

from dataclasses import asdict, dataclass

import numpy as np
from contestants import BASELINES, SHARP_BASELINES
from measure import HORIZONS
from tables import cells_of, paired_ratio
from worlds import SHARP

ALL = ("first", "between", "after")
MAIN = "stadium-white-1-constant"
VARYING = "stadium-white-1-varying"
OVALS = {
    "constant": "oval-white-1-constant",
    "speed +-15 %": "oval-white-1-varying",
    "stop and go": "oval-white-1-stop_and_go",
}
OWN_STAGES = {"coordinated_turn": ALL, "closed_path": ("after",)}
"""Stages in which an estimator's idea of its own error is judged: of closed_path, once the path has closed."""


@dataclass
class Verdict:
    """A claim, what was found, what was wanted, "met", "missed" or "not run", and a note."""

    claim: str
    value: float | None
    wanted: str
    verdict: str
    note: str = ""


def at_most(claim, value, limit, note="", unit=""):
    return _judge(claim, value, f"<= {limit:g}{unit}", lambda v: v <= limit, note)


def at_least(claim, value, limit, note="", unit=""):
    return _judge(claim, value, f">= {limit:g}{unit}", lambda v: v >= limit, note)


def _judge(claim, value, wanted, met, note):
    if value is None or not np.isfinite(value):
        return Verdict(claim, None, wanted, "not run", note)
    return Verdict(claim, float(f"{value:.4g}"), wanted, "met" if met(value) else "missed", note)


def verdicts(lines, times):
    """Returns a list of dicts, one for each number; ``times`` of `speed.update_times`."""
    cells = cells_of(lines)
    trials = {}
    for line in lines:
        if "trial" in line:
            trials.setdefault(line["cell"], []).append(line["trial"])
    found = [
        *_extrapolation(cells),
        *_own_world(trials.get("own_world", [])),
        *_baselines(cells),
        *_sharp_bends(cells),
        *_closed_path(cells, trials.get("moved", [])),
        *_coverage(cells),
        *_rice(trials.get("rice", [])),
        *_speed(times),
        *_link(trials.get("link", [])),
    ]
    return [asdict(verdict) for verdict in found]


def _ratio(cells, name, first, other, stages, horizon):
    """Returns (ratio, note with its interval) of two contestants in a cell, (None, "") when it was not run."""
    if name not in cells:
        return None, ""
    ratio, (low, high) = cells[name].ratio(first, other, stages, horizon)
    return ratio, f"95 %: {low:.3f}-{high:.3f}"


def _to_bound(cells, name, contestant, kind, stages, horizon):
    if name not in cells:
        return None, ""
    squares = cells[name].values(contestant, stages, horizon, "mean_square_mm2")
    ratio, (low, high) = paired_ratio(squares, cells[name].bound(kind, horizon))
    return ratio, f"95 %: {low:.3f}-{high:.3f}"


def _extrapolation(cells):
    for horizon, limit in (("present", 0.90), ("grasp", 0.85)):
        found = _ratio(cells, MAIN, "arc_length", "alpha_beta_gamma", ALL, horizon)
        yield at_most(f"arc_length / alpha_beta_gamma, 1 mm, {horizon}", found[0], limit, found[1])
    for horizon in HORIZONS:
        found = _ratio(cells, MAIN, "coordinated_turn", "alpha_beta_gamma", ALL, horizon)
        yield at_most(f"coordinated_turn / alpha_beta_gamma, 1 mm, {horizon}", found[0], 0.82, found[1])
    for horizon in HORIZONS:
        found = _to_bound(cells, MAIN, "coordinated_turn", "first_lap", ("first",), horizon)
        yield at_most(f"coordinated_turn / first-lap bound, 1 mm, {horizon}", found[0], 2.05, found[1])


def _own_world(trials):
    for place, horizon in enumerate(HORIZONS):
        squares = np.array([trial["mean_square_mm2"][place] for trial in trials])
        bound = np.array([trial["bound_mm2"][place] for trial in trials])
        ratio, (low, high) = paired_ratio(squares, bound)
        yield at_most(
            f"coordinated_turn / posterior bound in its own world, {horizon}",
            ratio,
            1.05,
            f"95 %: {low:.3f}-{high:.3f}",
        )


def _baselines(cells):
    """Beside the best of all baselines, tuned for that speed law by itself, at each horizon, whichever that is."""
    for law, name in OVALS.items():
        for horizon in HORIZONS:
            ratio, note = None, ""
            if name in cells:
                best = min(BASELINES, key=lambda baseline: cells[name].rms(baseline, ALL, horizon))
                ratio, note = _ratio(cells, name, "coordinated_turn", best, ALL, horizon)
                note = f"{best}; {note}"
            yield at_most(f"coordinated_turn / best baseline, oval, {law}, paired, {horizon}", ratio, 1.02, note)


def _sharp_bends(cells):
    """Beside the turn's filter with one setting for all paths, and beside the best of all that were run, of which the
    others are tuned for that path."""
    for path in SHARP:
        name = f"{path}-white-1-constant"
        for horizon in HORIZONS:
            found = _ratio(cells, name, "coordinated_turn", "filterpy_turn_fixed", ALL, horizon)
            claim = f"coordinated_turn / turn filter with one setting, {path}, paired, {horizon}"
            yield at_most(claim, found[0], 1.02, found[1])
        for horizon in HORIZONS:
            ratio, note = None, ""
            if name in cells:
                best = min(SHARP_BASELINES, key=lambda baseline: cells[name].rms(baseline, ALL, horizon))
                ratio, note = _ratio(cells, name, "coordinated_turn", best, ALL, horizon)
                note = f"{best}; {note}"
            yield at_most(f"coordinated_turn / best baseline, {path}, constant, paired, {horizon}", ratio, 1.02, note)


def _closed_path(cells, moved):
    for horizon in HORIZONS:
        found = _to_bound(cells, MAIN, "closed_path", "closed_path", ("after",), horizon)
        yield at_most(f"closed_path / its bound after closure, 1 mm, {horizon}", found[0], 1.4, found[1])
    found = _ratio(cells, MAIN, "closed_path", "alpha_beta_gamma", ("after",), "grasp")
    yield at_most("closed_path / alpha_beta_gamma after closure, 1 mm, grasp", found[0], 0.05, found[1])
    for horizon in HORIZONS:
        found = _ratio(cells, VARYING, "closed_path", "coordinated_turn", ("after",), horizon)
        claim = f"closed_path / coordinated_turn after closure, speed +-15 %, {horizon}"
        yield at_most(claim, found[0], 0.55, found[1])
    for horizon in HORIZONS if MAIN in cells else ():
        angle = cells[MAIN].rms("closed_path", ("after",), horizon, "heading_mean_square_deg2")
        yield at_most(f"heading error of closed_path after closure, 1 mm, rms, {horizon}", angle, 1.0, unit=" deg")
    for scope, among in (("white noise on the stadium", "stadium-white"), ("every cell", "")):
        worst, note = None, ""
        for name in (name for name in cells if name.startswith(among)):
            for horizon in HORIZONS:
                ratio, _ = cells[name].ratio("closed_path", "coordinated_turn", ("first",), horizon)
                if np.isfinite(ratio) and (worst is None or ratio > worst):
                    worst, note = ratio, f"worst: {name}, {horizon}"
        yield at_most(f"closed_path / coordinated_turn before closure, {scope}", worst, 1.02, note)
    laps = [trial["laps_until_back"] for trial in moved]
    note = f"worst of {len(laps)} runs; median {np.median(laps):.2f}" if laps else ""
    yield at_most("laps until closed_path is back after the track was moved", max(laps, default=None), 1.2, note)


def _coverage(cells):
    """The share farthest from 68 %, over the standard deviations and speed laws of white noise on the stadium."""
    for name, stages in OWN_STAGES.items():
        for horizon in HORIZONS:
            shares = {
                cell: float(np.nanmean(cells[cell].values(name, stages, horizon, "inside")))
                for cell in cells
                if cell.startswith("stadium-white-")
            }
            worst = max(shares, key=lambda cell: abs(shares[cell] - 0.68), default=None)
            value = None if worst is None else 100.0 * shares[worst]
            note = "" if worst is None else f"worst: {worst}"
            yield _judge(
                f"errors of {name} within predict_std, {horizon}",
                value,
                "68 +- 10 %",
                lambda v: 58.0 <= v <= 78.0,
                note,
            )


def _rice(trials):
    for ratio in trials[0] if trials else ("2.5",):
        recovered, plain, law = np.mean([trial[ratio] for trial in trials], axis=0) if trials else (np.nan,) * 3
        yield at_most(
            f"bias of arc_length's s_0 where s_0 is {ratio} times the noise", 100 * abs(recovered - 1.0), 0.5, unit=" %"
        )
        yield at_most(
            f"plain mean of chords beside Rice's law, {ratio}",
            100 * abs(plain / law - 1.0),
            1.0,
            f"the plain mean is {100 * (plain - 1.0):.1f} % too long",
            " %",
        )


def _speed(times):
    for name, limit in (("arc_length", 150), ("coordinated_turn", 500), ("closed_path", 600)):
        mean, faster = times.get(name, (None, None))
        yield at_most(f"one update of {name}", mean, limit, unit=" us")
        note = "Stone Soup has no closed path" if name == "closed_path" else ""
        yield at_least(f"Stone Soup's constant turn / {name}, time of an update in the same run", faster, 5.0, note)


def _link(trials):
    wanted = (("drops", "50 % dropped", 1.15), ("jitter", "and 0-100 ms jitter", 1.4), ("bursts", "bursts of 12", 3.5))
    for name, text, limit in wanted:
        squares, perfect = ([trial[kind][0] for trial in trials] for kind in (name, "perfect"))
        ratio, (low, high) = paired_ratio(np.array(squares), np.array(perfect))
        yield at_most(f"error over the link, {text} / perfect", ratio, limit, f"95 %: {low:.3f}-{high:.3f}")
    greatest = max((trial["late"][1] for trial in trials), default=None)
    if greatest is not None and any(not np.isfinite(trial["late"][1]) for trial in trials):
        greatest = 1e9
    note = "the limit is this benchmark's own: below half of the stadium's length, and 1e9 where there was a NaN"
    yield at_most("greatest error with 200 ms delay, jitter and bursts: no divergence", greatest, 250, note, " mm")


def print_verdicts(judged):
    print("| what | value | wanted | verdict | note |")
    print("|---|---|---|---|---|")
    for row in judged:
        value = "" if row["value"] is None else f"{row['value']:g}"
        print(f"| {row['claim']} | {value} | {row['wanted']} | {row['verdict']} | {row['note']} |")
    counts = {kind: sum(row["verdict"] == kind for row in judged) for kind in ("met", "missed", "not run")}
    print("\n" + ", ".join(f"{count} {kind}" for kind, count in counts.items()), flush=True)
