"""The table of `fuzz.py`; it needs no other library."""

from collections import Counter


def table(result):
    """Returns (header, rows) of a table with one row for each kind."""
    defects = Counter(defect["kind"] for defect in result["defects"])
    columns = result["by_kind"], result["accepted"], defects, result["longest_s"]
    rows = [[kind, *(column[kind] for column in columns)] for kind in result["by_kind"]]
    total = [result["cases"], sum(result["accepted"].values()), defects.total(), max(result["longest_s"].values())]
    return ["kind of case", "cases", "not refused", "defects", "longest [s]"], [*rows, ["all", *total]]
