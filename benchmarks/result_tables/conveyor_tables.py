"""Tables of the results of `conveyor.py`, for the terminal and for the documentation."""


def _mean(value, scale=1.0, decimals=1, unit=""):
    """Returns a mean with its interval, which one run does not have, as a text; empty without a mean."""
    if value is None:
        return ""
    mean, low, high = (scale * each for each in value)
    if low == high:
        return f"{mean:.{decimals}f}{unit}"
    return f"{mean:.{decimals}f}{unit} ({low:.{decimals}f} to {high:.{decimals}f})"


def _rate(value):
    """Returns a count of a total with its Wilson interval as a text."""
    count, total, low, high = value
    return f"{count} of {total} ({100.0 * low:.1f} to {100.0 * high:.1f} %)" if total else ""


def _number(value, scale, unit):
    """Returns a number as a text, empty without one."""
    return "" if value is None else f"{scale * value:.1f} {unit}"


def _causes(cell):
    """Returns why parts were missed as a text."""
    return ", ".join(f"{count} {cause}" for cause, count in cell["missed_because"].items())


def capacity_table(cells):
    """Returns (header, rows) of the runs in which parts are always waiting."""
    header = ["cell", "runs", "picks a minute", "share of the clairvoyant bound", "dropped", "misplaced", "doubles"]
    return header, [
        [
            cell["cell"],
            cell["runs"],
            _mean(cell["picks_per_minute"]),
            _mean(cell["share_of_clairvoyant"], 100.0, 0, " %"),
            _rate(cell["dropped"]),
            _rate(cell["misplaced"]),
            cell["doubles"],
        ]
        for cell in cells
    ]


def load_table(cells):
    """Returns (header, rows) of the runs at a part of the capacity."""
    header = ["cell", "runs", "picks a minute", "not placed, of those that could be picked", "dropped", "misplaced"]
    header += [
        "doubles",
        "position error, rms",
        "direction error, rms",
        "belt, tray or table touched",
        "missed because",
    ]
    return header, [
        [
            cell["cell"],
            cell["runs"],
            _mean(cell["picks_per_minute"]),
            _rate(cell["lost"]),
            _rate(cell["dropped"]),
            _rate(cell["misplaced"]),
            cell["doubles"],
            _number(cell["placement_rms_m"], 1e3, "mm"),
            _number(cell["placement_turn_rms_rad"], 57.29578, "deg"),
            cell["touched"],
            _causes(cell),
        ]
        for cell in cells
    ]


def saturated_table(cells):
    """Returns (header, rows) of the dispatchers; each is compared with first in first out for the same arrivals."""
    first = {
        cell["cell"].split(": ")[0]: cell["picks_per_minute"][0]
        for cell in cells
        if "first in first out" in cell["cell"]
    }
    rows = []
    for cell in cells:
        base = first.get(cell["cell"].split(": ")[0])
        gain = f"{100.0 * (cell['picks_per_minute'][0] / base - 1.0):+.0f} %" if base else ""
        share = _mean(cell["share_of_clairvoyant"], 100.0, 0, " %")
        rows.append([cell["cell"], cell["runs"], _mean(cell["picks_per_minute"]), share, gain])
    header = ["arrivals, dispatcher", "runs", "picks a minute", "share of the clairvoyant bound"]
    return [*header, "over first in first out"], rows


def map_table(cells):
    """Returns (header, rows) of the speeds of the belt and the rates of arrival."""
    header = ["belt, arrivals", "runs", "picks a minute", "share of the clairvoyant bound"]
    header += ["not placed, of those that could be picked", "missed because"]
    return header, [
        [
            cell["cell"],
            cell["runs"],
            _mean(cell["picks_per_minute"]),
            _mean(cell["share_of_clairvoyant"], 100.0, 0, " %"),
            _rate(cell["lost"]),
            _causes(cell),
        ]
        for cell in cells
    ]


def speed_table(cells):
    """Returns (header, rows) of the speeds of the loop; each is compared with the first one."""
    first = cells[0]["real_time_factor"]
    header = ["belt, vision", "parts in view, mean", "simulated seconds per second", "compared with the first"]
    return header, [
        [
            cell["cell"],
            f"{cell['in_view']:.1f}",
            f"{cell['real_time_factor']:.2f}",
            f"{cell['real_time_factor'] / first:.2f}",
        ]
        for cell in cells
    ]


TABLES = {
    "capacity": capacity_table,
    "load": load_table,
    "saturated": saturated_table,
    "map": map_table,
    "stop": load_table,
    "incline": load_table,
    "speed": speed_table,
}
"""{part: its table}."""
