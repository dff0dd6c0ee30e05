"""Tables of the results of `several.py`, for the terminal and for the documentation."""

import statistics

from shared.common import interval, percent


def per_mille(count, total):
    """Returns a small share as a text, in percent with two decimals."""
    return f"{100 * count / total:.2f} %" if total else ""


def separation_table(cells):
    """Returns (header, rows) of the separations, from the second lap on and in the first one."""
    header = ["separation", "trains", "places, 2nd lap on", "Wilson 95 %", "images, 2nd lap on", "images, 1st lap"]
    header += ["points on neither", "`!MotionCentroid`: images", "`!MotionCentroid`: on neither"]
    header += ["both tracked after", "swaps", "begun again", "lost"]
    rows = []
    for cell in cells:
        later, first, single = cell["several_later"], cell["several_first_lap"], cell["single_later"]
        times = [time for time in cell["time_until_both_s"] if time is not None]
        rows.append(
            [
                f"{cell['cell']:.2f} m",
                "whole" if cell["scale"] == 1.0 else f"{cell['scale']} of the length",
                f"{later['good_places']} of {later['places']}",
                interval(later["good_places"], later["places"]) if later["places"] else "",
                percent(later["both"] / later["images"]),
                percent(first["both"] / first["images"]),
                per_mille(first["neither"] + later["neither"], first["valid"] + later["valid"]),
                percent(single["one"] / single["images"]),
                percent(single["neither"] / single["valid"] if single["valid"] else None),
                f"{statistics.median(times):.1f} s ({len(times)} of {cell['runs']})" if times else "never",
                *(cell[key] for key in ("swaps", "begun_again", "lost")),
            ]
        )
    return header, rows


def passing_table(cells):
    """Returns (header, rows) of the trains in opposite directions."""
    header = ["runs", "without any change", "Wilson 95 %", "swaps", "begun again", "lost", "images with both in place"]
    return header, [
        [
            cell["runs"],
            cell["clean_runs"],
            interval(cell["clean_runs"], cell["runs"]),
            *(cell[key] for key in ("swaps", "begun_again", "lost")),
            percent(cell["both"] / cell["images"]),
        ]
        for cell in cells
    ]


def coverage_table(cells):
    """Returns (header, rows) of the share of the errors within one standard deviation."""
    header = ["cell", "runs", "points", "x", "y", "z", "all axes", "95 %", "rms x, y, z", "mean x, y, z"]
    header.append("points on no object")
    rows = []
    for cell in cells:
        found = cell["coverage"]
        shares = [percent(found[axis][0]) if found else "" for axis in (*"xyz", "all")]
        limits = "{:.0f}-{:.0f} %".format(*(100 * value for value in found["all"][1:])) if found else ""
        rms, mean = (
            " / ".join(f"{value:{kind}.1f}" for value in cell[f"{name}_mm"])
            for name, kind in (("rms", ""), ("mean", "+"))
        )
        rows.append(
            [cell["cell"], cell["runs"], cell["points"], *shares, limits, f"{rms} mm", f"{mean} mm", cell["strays"]]
        )
    return header, rows


def lift_table(cells):
    """Returns (header, rows) of the runs of the whole loop."""
    header = [
        "cell",
        "runs",
        "first attempt",
        "Wilson 95 %",
        "lifted",
        "Wilson 95 %",
        "median time to grasp",
        "failures",
    ]
    rows = []
    for cell in cells:
        times, total = cell["times_to_grasp_s"], cell["runs"]
        counts = [text for key in ("first_attempt", "lifted") for text in (cell[key], interval(cell[key], total))]
        reasons = "; ".join(f"{count} times: {reason}" for reason, count in cell["reasons"].items())
        rows.append([cell["cell"], total, *counts, f"{statistics.median(times):.1f} s" if times else "", reasons])
    return header, rows


def shake_table(cells):
    """Returns (header, rows) of the moving cameras, with `!MotionCentroid` beside."""
    header = ["camera"]
    for name in ("`!SilhouetteTracker`", "`!MotionCentroid`"):
        header += [f"{name}: median error", "unusable", "no centroid", "wrong"]
    rows = []
    for cell in cells:
        row = [cell["cell"]]
        for name in ("several", "single"):
            found = cell[name]
            row.append("" if found["median_px"] is None else f"{found['median_px']:.1f} px")
            row += [percent(found[key]) for key in ("unusable", "invalid", "wrong")]
        rows.append(row)
    return header, rows


def cost_table(cells):
    """Returns (header, rows) of the times."""
    header = ["what", "`!SilhouetteTracker`", "`!MotionCentroid`", "ratio"]
    return header, [
        [cell["cell"], *(f"{cell[name]:.2f} {cell['unit']}" for name in ("several", "single")), f"{cell['ratio']:.2f}"]
        for cell in cells
    ]


TABLES = {
    "separation": separation_table,
    "passing": passing_table,
    "coverage": coverage_table,
    "lift": lift_table,
    "cameras": lift_table,
    "shake": shake_table,
    "cost": cost_table,
}
