"""The table of `rivals.py`."""

from dataclasses import dataclass

from shared.common import share


@dataclass(frozen=True)
class Rival:
    """What others published, and in what their task is another one.

    Attributes:
        name: of the benchmark, with its source.
        differs: in what its task differs from ours.
        published: {motion, or text of a speed: published success rate as a text}; "" for all others.
    """

    name: str
    differs: str
    published: dict[str, str]


def _walks(fixed, wrist):
    return {
        speed: f"{two} with two fixed cameras, {one} with one on the wrist"
        for speed, two, one in zip(("0.1", "0.125", "0.15", "0.175", "0.2"), fixed, wrist, strict=True)
    }


_DGBENCH = _walks((100, 100, 70, 60, 55), (100, 85, 50, 30, 20))
RIVALS = {
    "dgbench": Rival(
        "DGBench, arXiv 2204.13879", "real arm, cameras and platform, 20 walks; rates from a figure", _DGBENCH
    ),
    "dgbench_140": Rival(
        "DGBench, arXiv 2204.13879", "the same; besides, their walks are twice as wide, with other corners", _DGBENCH
    ),
    "domino": Rival(
        "DOMINO, arXiv 2603.15620",
        "35 tasks of two arms, told in words, of which the grasp is a part; the object stops when it is touched",
        {"1, constant velocity": "71", "2, polynomial": "4", "3, chaotic": "8", "": "17.2 over all"},
    ),
    "dom": Rival(
        "DynamicVLA, arXiv 2601.22153",
        "tasks told in words, 206 objects that slide and roll freely; one rate over all speeds and tasks",
        {"": "47"},
    ),
    "columbia": Rival(
        "Akinola et al. 2021, arXiv 2103.10562",
        "household objects at varying heights, other arms and distances; true pose without lag",
        {"": "75 to 95"},
    ),
}
"""{family: the rival}. A published rate is in percent."""


def describe(row):
    """Returns the outcome of a run as a text."""
    said = f"{row['rival']} {row['motion']} {row['speed']:.3g} m/s lag {row['lag']} seed {row['seed']}: "
    if row["out_of_reach"]:
        return said + f"out of reach: {row['failure_reason']}"
    return said + (f"lifted at attempt {row['attempts']}" if row["success"] else str(row["failure_reason"]))


def published_rate(row):
    """Returns the published success rate that belongs to a run, as a text."""
    published = RIVALS[row["rival"]].published
    return next(published[key] for key in (row["motion"], row["speeds"], "") if key in published)


def rivals_table(rows):
    """Returns (header, rows) of a table with one row for each rival, motion, speed, vision and lag."""
    lines = []
    for cell in sorted({_cell(row) for row in rows}):
        runs = [row for row in rows if _cell(row) == cell]
        family, motion, _, speeds, rendered, lag = cell
        rival, beyond = RIVALS[list(RIVALS)[family]], sum(row["out_of_reach"] for row in runs)
        lifted = list(share(sum(bool(row["success"]) for row in runs), len(runs)))
        vision = "cameras" if rendered else "measured vision"
        reach = "" if not beyond else f"{beyond}: {_reasons(runs)}"
        lines.append(
            [rival.name, motion, speeds, vision, lag, len(runs), *lifted, reach, published_rate(runs[0]), rival.differs]
        )
    header = ["rival", "motion", "speed [m/s]", "vision", "lag [cycles]", "runs", "lifted", "Wilson 95 %"]
    return [*header, "out of reach", "published [%]", "in what their task differs"], lines


def _cell(row):
    """Returns (place of the family, motion, first speed, text of the speeds, rendered, lag) of a row."""
    first = float(row["speeds"].split(" to ")[0])
    return list(RIVALS).index(row["rival"]), row["motion"], first, row["speeds"], row["rendered"], row["lag"]


def _reasons(rows):
    """Returns the reason why paths are out of reach, of the one with the longest time within reach."""
    return max((row["failure_reason"] for row in rows if row["out_of_reach"]), key=_time_within)


def _time_within(reason):
    return float(reason.split("reach for ")[1].split(" s")[0])
