"""The tables of `space_filter.py`."""


def moments_table(found):
    """Returns (header, rows) of a table with one row for each ratio of arc length and noise."""
    lines = [
        [
            f"{row['ratio']:g}",
            *(f"{100.0 * (row[key] - 1.0):+.1f} %" for key in ("s_0_3", "sigma_3", "s_0_2", "sigma_2")),
        ]
        for row in found["moments"]
    ]
    return ["s_0 / sigma", "error of s_0", "of sigma", "of s_0, planar inversion", "of sigma, planar inversion"], lines


def paths_table(found):
    """Returns (header, rows) of a table with one row for each path and speed; errors per axis."""
    lines = []
    for row in found["rows"]:
        level = row["level"] if row["path"].startswith("helix") else None
        ratios = [f"{a / b:.2f}" for a, b in zip(row["space"], level, strict=True)] if level else ["", ""]
        errors = [f"{1e3 * value:.1f}" for pair in zip(row["space"], row["plane"], strict=True) for value in pair]
        lines.append([f"{row['path']}, radius {1e3 * row['radius']:.0f} mm", f"{row['speed']:g}", *errors, *ratios])
    header = ["path", "speed [m/s]"]
    header += [f"{mode}, {ahead} s [mm]" for ahead in ("0.25", "0.75") for mode in ("space", "baseline")]
    return [*header, "ratio to a level circle, 0.25 s", "0.75 s"], lines


def estimators_table(found):
    """Returns (header, rows) of a table with one row for each estimator on the hill."""
    lines = [
        [f"`{row['estimator']}`", *(f"{1e3 * row[key][k]:.1f}" for key in ("level", "height") for k in (0, 1))]
        for row in found["estimators"]
    ]
    header = [f"{what}, {ahead} s [mm]" for what in ("in the level", "height") for ahead in ("0.25", "0.75")]
    return ["estimator", *header], lines


TABLES = {"moments": moments_table, "paths": paths_table, "estimators": estimators_table}
