"""Table of the results of `footage.py`, for the terminal and for the documentation."""


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


TABLES = {"accuracy": table}
