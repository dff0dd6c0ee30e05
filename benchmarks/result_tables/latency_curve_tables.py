"""The table and the picture of `latency_curve.py`."""

from dataclasses import replace

from shared.common import interval, percent

from drake_tracker.campaign.rates import rates_of

POLICIES = ("last_point", "straight_line", "1991", "truth", "guided")
"""The last one is not for the ball; so each has the same colour in all axes."""
KEYS = ("total latency", "policy")
"""What varies in a cell."""


def describe(row):
    """Returns the outcome of an episode as a text."""
    outcome = row["reason"] or "the time was up"
    return f"{row['cell']}, {row['policy']}, {row['lag_cycles'] / 60:.2f} s, seed {row['seed']}: {outcome}"


def rates(rows, cell):
    """Returns the `Rate` of each policy at each latency of a cell.

    ``truth`` sees the present position. It was run at one latency only, and its rate stands for all of them.
    """
    runs = [
        {"success": row["success"], "settings": dict(zip(KEYS, (f"{row['lag_cycles'] / 60:.2f}", row["policy"])))}
        for row in rows
        if row["cell"] == cell
    ]
    latencies = sorted({run["settings"][KEYS[0]] for run in runs})
    found = []
    for policy in POLICIES:
        each = rates_of(runs, [dict(zip(KEYS, (latency, policy))) for latency in latencies])
        each = [rate for rate in each if rate.trials]
        if policy == "truth":
            each = [replace(rate, settings=dict(zip(KEYS, (at, policy)))) for rate in each[:1] for at in latencies]
        found += each
    return found


def latency_table(rows):
    """Returns (header, rows) of a table with one row for each cell and latency, and one column for each policy."""
    lines = []
    for cell in dict.fromkeys(row["cell"] for row in rows):
        texts = {}
        for rate in rates(rows, cell):
            low_high = interval(rate.successes, rate.trials).removesuffix(" %")
            latency, policy = rate.settings.values()
            texts.setdefault(latency, {})[policy] = f"{percent(rate.share)} ({low_high})"
        lines += [
            [cell, latency, *(texts[latency].get(policy, "") for policy in POLICIES)] for latency in sorted(texts)
        ]
    return ["object", "total latency [s]", *(policy.replace("_", " ") for policy in POLICIES)], lines


def draw(rows, path):
    """Draws the successes over the latency, with Wilson intervals: axes for each cell, a line for each policy."""
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    from drake_tracker.campaign.plots import draw_lines
    from drake_tracker.tasks.style import PLOT_STYLE

    cells = list(dict.fromkeys(row["cell"] for row in rows))
    with matplotlib.rc_context(PLOT_STYLE):
        figure = Figure(figsize=(6.0 * len(cells), 4.6), facecolor="white", layout="constrained")
        FigureCanvasAgg(figure)
        axes = figure.subplots(1, len(cells), sharey=True, squeeze=False)[0]
        for ax, cell in zip(axes, cells, strict=True):
            draw_lines(ax, rates(rows, cell), KEYS, KEYS[0], True, {KEYS[0]: "s"})
            ax.set(title=cell, ylabel="" if ax is not axes[0] else ax.get_ylabel())
            ticks = [0.1 * k for k in range(6)]
            ax.set_xticks(ticks, [f"{tick:.1f}" for tick in ticks])
            ax.legend().remove()
        labelled = axes[0].get_legend_handles_labels()
        figure.legend(*labelled, loc="outside lower center", ncols=len(POLICIES), frameon=False)
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, dpi=110)
    print(f"wrote {path}")
