"""Estimators in synthetic worlds (`results/estimation.json`, `results/estimation.jsonl`)."""

from result_tables import space_filter_tables as space

from tables.results import Row, block, commit_of, data, lines, listed, ranges, table

_OURS = ("alpha_beta_gamma", "arc_length", "coordinated_turn", "closed_path")
_HORIZONS = {"present": "0.25 s", "grasp": "0.75 s"}
_LAWS = {"constant": "constant", "varying": "+-15 %", "stop_and_go": "stop and go"}
_PATHS = ("stadium", "oval", "circle", "figure_eight", "spline")
_STADIUM = {(f"{sigma} mm",): f"stadium-white-{sigma}-constant" for sigma in ("0.5", "1", "2", "4")}
_SHARP = {
    "coordinated_turn": "coordinated_turn",
    "coordinated_turn_single": "its filter for gentle bends alone",
    "closed_path": "closed_path, on the first lap",
    "arc_length": "arc_length",
    "alpha_beta_gamma": "alpha_beta_gamma",
    "stonesoup_turn": "stonesoup_turn, tuned for this path and law",
    "filterpy_turn": "filterpy_turn, likewise",
    "filterpy_turn_fixed": "filterpy_turn, one setting for all",
}
"""{contestant: its name in the tables of the paths with sharp bends}."""
_SHARP_PATHS = ("rectangle", "bean")
_NOISES = ("white", "autocorrelated", "anisotropic", "replayed")


def space_moments() -> str:
    return table(*space.moments_table(data("space_filter")))


def space_paths() -> str:
    return table(*space.paths_table(data("space_filter")))


def space_estimators() -> str:
    found = data("space_filter")
    made_by = found["made_by"]
    text = f"*Seeds {ranges(made_by['seeds'])}, commit `{commit_of(made_by)}`.*"
    return block(table(*space.estimators_table(found)), text)


def estimators_noise() -> str:
    return _tables(["noise of a point"], _STADIUM)


def estimators_speed() -> str:
    cells = {(noise, shown): f"stadium-{noise}-1-{law}" for noise in _NOISES for law, shown in _LAWS.items()}
    return _tables(["noise", "speed"], cells)


def estimators_paths() -> str:
    return _tables(["path"], {(path,): f"{path}-white-1-constant" for path in _PATHS[1:]})


def estimators_literal() -> str:
    rows = [
        [*shown, *(_cell(cell, "arc_length_literal", horizon, "after") for horizon in _HORIZONS)]
        for shown, cell in _STADIUM.items()
    ]
    header = ["noise of a point", *(f"{ahead} ahead" for ahead in _HORIZONS.values())]
    return block(table(header, rows), _origin(list(_STADIUM.values()), ("arc_length_literal",)))


def estimators_baselines() -> str:
    cells = [f"oval-white-1-{law}" for law in _LAWS]
    contestants = dict.fromkeys(row["contestant"] for row in data("estimation")["table"] if row["cell"] in cells)
    names = ["coordinated_turn", *(name for name in contestants if name.startswith(("stonesoup", "filterpy")))]
    parts = []
    for horizon, ahead in _HORIZONS.items():
        rows = [[name, *(_cell(cell, name, horizon, "after") for cell in cells)] for name in names]
        parts += [f"{ahead} ahead:", table(["filter", *_LAWS.values()], rows)]
    return block(*parts, _origin(cells, tuple(names)))


def estimators_sharp() -> str:
    cells = [f"{path}-white-1-{law}" for path in _SHARP_PATHS for law in _LAWS]
    header = ["filter", *(f"{path}, {law}" for path in _SHARP_PATHS for law in _LAWS.values())]
    parts = []
    for horizon, ahead in _HORIZONS.items():
        rows = []
        for name, label in _SHARP.items():
            stage = "first" if name == "closed_path" else "after"
            rows.append([label, *(_cell(cell, name, horizon, stage) for cell in cells)])
            if name == "closed_path":
                rows.append(["closed_path, afterwards", *(_cell(cell, name, horizon, "after") for cell in cells)])
        parts += [f"{ahead} ahead:", table(header, rows)]
    return block(*parts, _origin(cells, tuple(_SHARP)))


def estimators_sharp_ratios() -> str:
    kinds = {"turn filter with one setting, {}": "one setting for all", "best baseline, {}, constant": "the best one"}
    verdicts = {row["claim"]: row for row in data("estimation")["verdicts"]}
    rows = []
    for path in _SHARP_PATHS:
        for kind, label in kinds.items():
            found = [verdicts[f"coordinated_turn / {kind.format(path)}, paired, {horizon}"] for horizon in _HORIZONS]
            rows.append([path, label, *(f"{row['value']:.2f} ({row['note'].split('95 %: ')[1]})" for row in found)])
    header = ["path", "filter of constant turn", *(f"{ahead} ahead" for ahead in _HORIZONS.values())]
    return table(header, rows)


def estimators_verdicts() -> str:
    rows = []
    for row in data("estimation")["verdicts"]:
        value = "" if row["value"] is None else f"{row['value']:g}"
        rows.append([row["claim"], value, row["wanted"], row["verdict"], row["note"]])
    return table(["what", "value", "target", "verdict", "note"], rows)


def estimators_verdicts_summary() -> str:
    verdicts = data("estimation")["verdicts"]
    met, missed, not_run = (
        [row for row in verdicts if row["verdict"] == kind] for kind in ("met", "missed", "not run")
    )
    parts = [
        f"{len(met)} of {len(met) + len(missed)} targets, which were set before the measurement, are met. Missed:",
        "\n".join(
            f"- {row['claim']}: {row['value']:g}, target {row['wanted']} {_note(row)}".rstrip() for row in missed
        ),
    ]
    if not_run:
        parts += ["Not measured since the last change:", "\n".join(f"- {row['claim']}" for row in not_run)]
    return block(*parts)


def _note(row: Row) -> str:
    return f"({row['note']})" if row["note"] else ""


def estimators_bounds() -> str:
    claims = {
        "closed path, to its bound after closure": "closed_path / its bound after closure, 1 mm",
        "coordinated turn, to the bound of the first lap": "coordinated_turn / first-lap bound, 1 mm",
    }
    rows = []
    for label, claim in claims.items():
        found = [next(v for v in data("estimation")["verdicts"] if v["claim"] == f"{claim}, {h}") for h in _HORIZONS]
        rows.append([label, *(f"{v['value']:.2f} ({v['note'].removeprefix('95 %: ')})" for v in found)])
    return table(["ratio of the rms errors (95 % interval)", *(f"{ahead} ahead" for ahead in _HORIZONS.values())], rows)


def estimators_ratios() -> str:
    verdicts = {row["claim"]: row for row in data("estimation")["verdicts"]}
    closed = verdicts["closed_path / alpha_beta_gamma after closure, 1 mm, grasp"]["value"]
    baselines = [row["value"] for claim, row in verdicts.items() if "best baseline, oval" in claim]
    return (
        f"At 1 mm of white noise, the closed path's error 0.75 s ahead is {closed:.3f} times that of alpha-beta-gamma. "
        f"On the oval, the coordinated turn's error is {min(baselines):.2f} to {max(baselines):.2f} times that of the "
        "best baseline over three speed laws and both horizons."
    )


def estimators_coverage() -> str:
    rows, constant = [], []
    for path in _PATHS:
        shares = [
            100 * _row(f"{path}-replayed-1-{law}", "closed_path", horizon, "after")["inside"]
            for law in _LAWS
            for horizon in _HORIZONS
        ]
        constant += shares[: len(_HORIZONS)]
        rows.append([path, *(f"{share:.1f} %" for share in shares)])
    text = (
        f"At constant speed, {min(constant):.1f} to {max(constant):.1f} % of the closed path's errors lie within its "
        "own standard deviation, where 68 % are expected:"
    )
    header = [f"{shown}, {ahead}" for shown in _LAWS.values() for ahead in _HORIZONS.values()]
    cells = [f"{path}-replayed-1-{law}" for path in _PATHS for law in _LAWS]
    return block(text, table(["path", *header], rows), _origin(cells, ("closed_path",)))


def estimators_moved_track() -> str:
    verdict = next(row for row in data("estimation")["verdicts"] if "track was moved" in row["claim"])
    return f"Laps until the closed path has found a moved track again: {verdict['value']:g} ({verdict['note']})."


def estimators_update_time() -> str:
    times = data("estimation")["update_us"]
    names = {"coordinated_turn_single": "one of the two filters of coordinated_turn"}
    rows = [[names.get(name, name), f"{mean:.0f}", f"{ratio:.1f}"] for name, (mean, ratio) in times.items()]
    return table(["filter", "time of an update [us]", "Stone Soup's constant turn / this filter"], rows)


def _row(cell: str, name: str, horizon: str, stage: str) -> Row | None:
    for row in data("estimation")["table"]:
        if (row["cell"], row["contestant"], row["horizon"], row["stage"]) == (cell, name, horizon, stage):
            return row
    return None


def _cell(cell: str, name: str, horizon: str, stage: str) -> str:
    row = _row(cell, name, horizon, stage)
    return "" if row is None else "{:.2f} ({:.2f}-{:.2f})".format(row["rms_mm"], *row["rms_mm_interval"])


def _tables(
    labels: list[str], cells: dict[tuple[str, ...], str], names: tuple[str, ...] | dict[str, str] = _OURS
) -> str:
    """Returns a table for each horizon.

    Args:
        labels: names of the first columns.
        cells: {what stands in the first columns: name of the cell}.
        names: the contestants, or {contestant: name of its column}.
    """
    parts = []
    columns = names.values() if isinstance(names, dict) else names
    for horizon, ahead in _HORIZONS.items():
        rows = [[*shown, *(_cell(cell, name, horizon, "after") for name in names)] for shown, cell in cells.items()]
        parts += [f"{ahead} ahead:", table([*labels, *columns], rows)]
    return block(*parts, _origin(list(cells.values()), tuple(names)))


def _origin(cells: list[str], names: tuple[str, ...] = _OURS) -> str:
    """Returns seeds and the commits that made the results of each contestant in these cells."""
    made: dict[str, set[str]] = {}
    seeds = set()
    newest: dict[tuple[str, int, str], str] = {}
    for line in lines("estimation"):
        if line["cell"] in cells and "results" in line:
            seeds.add(line["seed"])
            for name in line["results"]:
                newest[line["cell"], line["seed"], name] = commit_of(line)
    for (_, _, name), commit in newest.items():
        if name in names:
            made.setdefault(name, set()).add(commit)
    by_commits: dict[str, list[str]] = {}
    for name, found in made.items():
        by_commits.setdefault(listed([f"`{commit}`" for commit in sorted(found)]), []).append(name)
    texts = [f"{', '.join(found)}: {commit}" for commit, found in by_commits.items()]
    return f"*Seeds {ranges(seeds)}, {len(seeds)} runs per cell. Commits: {'; '.join(texts)}.*"
