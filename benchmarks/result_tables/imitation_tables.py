"""The table of `imitation.py`."""

from shared.common import share


def imitation_table(found):
    """Returns (header, rows) of a table with one row for each policy."""
    names = {"imitation": f"network, imitates guided ({found['episodes']} episodes)"}
    lines = []
    for row in found["rows"]:
        failures = [reason or "the time was up" for reason in row["reasons"] if reason is not None]
        counted = "; ".join(f"{failures.count(reason)}: {reason}" for reason in dict.fromkeys(failures))
        lifted = share(row["runs"] - len(failures), row["runs"])
        lines.append([row["scenario"], names.get(row["policy"], row["policy"].replace("_", " ")), *lifted, counted])
    return ["scenario", "policy", "lifted", "Wilson 95 %", "failures"], lines
