"""Table of the results of `latency.py`, for the terminal and for the documentation."""


def table(cells):
    """Returns (header, rows) of the results."""
    header = ["condition", "clips", "median error", "worst", "within 2 ms", "within the uncertainty", "uncertainty"]
    return header, [
        [
            cell["cell"],
            cell["clips"],
            f"{cell['median_ms']:.2f} ms",
            f"{cell['worst_ms']:.2f} ms",
            f"{cell['within_2_ms']} of {cell['clips']}",
            f"{cell['within_uncertainty']} of {cell['clips']}",
            f"{cell['uncertainty_ms']:.1f} ms",
        ]
        for cell in cells
    ]


TABLES = {"accuracy": table}
