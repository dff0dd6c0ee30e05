"""Tables of the results of `footage.py`, for the terminal and for the documentation."""

DECODING = "decoding alone"
"""End of the names of cells that only decode."""


def table(cells):
    """Returns (header, rows) of the results."""
    header = ["clips, method", "clips", "median error", "95th percentile", "wrong", "missed", "identities kept"]

    def number(value):
        return "" if value is None else f"{value:.1f} px"

    return header, [
        [
            cell["cell"],
            cell["clips"],
            number(cell["median_px"]),
            number(cell["p95_px"]),
            "" if cell["wrong"] is None else f"{100 * cell['wrong']:.1f} %",
            f"{100 * cell['missed']:.1f} %",
            "" if cell["kept"] is None else f"{cell['kept']} of {cell['clips']}",
        ]
        for cell in cells
    ]


def files(cells):
    """Returns (header, rows) of the results of each kind of file."""
    header = ["file", "clips", "median", "95th percentile", "images with a place", "left out", "reported as dropped"]
    return header, [
        [
            cell["cell"],
            cell["clips"],
            f"{cell['median_px']:.2f} px",
            f"{cell['p95_px']:.2f} px",
            f"{cell['valid']} of {cell['expected']}",
            cell["left_out"],
            cell["dropped"],
        ]
        for cell in cells
    ]


def person(cells):
    """Returns (header, rows) of the results of each unit of length."""
    header = ["calibration in", "clips", "points", "filtered", "with a prediction", "error of the predictions"]
    return header, [
        [
            cell["cell"],
            cell["clips"],
            cell["points"],
            f"{cell['filtered']} ({100 * cell['filtered'] / cell['points']:.1f} %)",
            cell["predicted"],
            f"{100 * cell['prediction_rms_m']:.1f} cm",
        ]
        for cell in cells
    ]


def several(cells):
    """Returns (header, rows) of the results of several objects with two cameras."""
    header = ["two objects", "clips", "points", "median error", "95th percentile", "wrong", "identities kept"]
    return header, [
        [
            cell["cell"],
            cell["clips"],
            f"{cell['points']} of {cell['possible']}",
            f"{1e3 * cell['median_m']:.1f} mm",
            f"{1e3 * cell['p95_m']:.1f} mm",
            f"{100 * cell['wrong']:.1f} %",
            f"{cell['kept']} of {cell['clips']}",
        ]
        for cell in cells
    ]


def speed(cells):
    """Returns (header, rows) of the results of the command, each as a share of decoding alone in the same run."""
    alone = {cell["cell"].rsplit(", ", 1)[0]: cell["images_per_s"] for cell in cells if cell["cell"].endswith(DECODING)}
    rows = []
    for cell in cells:
        rate, whole = cell["images_per_s"], alone.get(cell["cell"].rsplit(", ", 1)[0])
        rows.append([cell["cell"], f"{rate:.0f}", "" if whole is None else f"{rate / whole:.2f}"])
    return ["command", "images or pairs per second", "share of decoding alone"], rows


TABLES = {
    "accuracy": table,
    "photographs": table,
    "files": files,
    "fast": table,
    "hidden": table,
    "person": person,
    "several": several,
    "speed": speed,
}
