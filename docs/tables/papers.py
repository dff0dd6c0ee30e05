"""The claims of both papers, one by one, with what was measured of each (page *The papers, claim by claim*)."""

import math
import statistics
from collections.abc import Callable, Sequence

import ball as balls
import ball_camera as camera
from result_tables import fault_tables
from shared.common import interval, percent
from train_grasp import PAPER_CELLS, lifted

from drake_tracker.core.timing import BALL_SERVO_PERIOD
from drake_tracker.estimation.parts.kaiser import kaiser_order
from drake_tracker.world.ball.ball_board import BALL_RADIUS
from tables.headline import rung_rows
from tables.marks import MARK, stale
from tables.results import Row, data, lines, listed, table, uses, where

HOLDS, CHANGED, REFUTED = "holds", "holds with a change", "does not hold here"
_HEADER = ["claim", "where", "measured", "verdict", "see"]
_BALL, _TRAIN, _VISION, _ESTIMATORS, _TRACKING = (
    f"[{name.title()}](../results/{name}.md)" for name in ("ball", "train", "vision", "estimators", "tracking")
)
_FIGURES = "`benchmarks/paper_figures.py`"
_TEST = "`tests/estimation/parts/test_{}.py`"
_FLOW, _DIFFERENCE = "normal flow, as for the train", "frame difference"
Claim = tuple[str, str, "str | Callable[[], str]", str, str]
"""(claim, section of the paper, what was measured or a function that returns it, verdict, where to read more)."""
_LIGHTS = ("striped", "round", "one-sided-light", "flicker-5%")


def claims_allen() -> str:
    return _claims("A", _ALLEN)


def claims_nashman() -> str:
    return _claims("B", _NASHMAN)


def _claims(letter: str, claims: Sequence[Claim]) -> str:
    """Returns the table of a paper. A claim is marked if its own results rest on another behaviour."""
    rows, others = [], set()
    for number, (claim, section, measured, verdict, see) in enumerate(claims, 1):
        names: set[str] = set()
        if not isinstance(measured, str):
            measured, names = stale(measured)
        others |= names
        rows.append([f"{letter}{number}. {claim}{MARK if names else ''}", section, measured, verdict, see])
    text = table(_HEADER, rows)
    if not others:
        return text
    what = listed([f"`{name}`" for name in sorted(others)])
    return f"{text}\n\n*{MARK.strip()} Earlier behaviour of {what}.*"


def _hills() -> str:
    runs = [row for row in lines("hard_paths") if row["kind"] == "hills" and row["scenario"] == "train:hill"]
    uses(*runs)
    shares = []
    for rendered, vision in ((True, "cameras"), (False, "measured vision")):
        first = [bool(row["first_attempt_success"]) for row in runs if row["rendered"] == rendered]
        shares.append(f"{sum(first)} of {len(first)} with {vision}")
    return f"with torsion, `train:hill` lifted at the first attempt: {', '.join(shares)}"


def _rate(scenario: str, cells: Sequence[str] = ()) -> str:
    """Returns "N of M at the first attempt (A-B %)" of a scenario, in some cells or in all."""
    runs = rung_rows(scenario)
    runs = where(runs, cell=cells.__contains__) if cells else runs
    uses(*runs)
    first = lifted(runs)[1]
    return f"{first} of {len(runs)} at the first attempt ({interval(first, len(runs))})"


def _median(key: str) -> float:
    runs = rung_rows("train")
    uses(*runs)
    return statistics.median(row[key] for row in runs if row[key] is not None)


def _lag() -> str:
    runs = rung_rows("train")
    uses(*runs)
    lags = sorted({round(1e3 * row["lag_s"][end], 2) for row in runs for end in ("min", "max")})
    return (
        f"{listed([f'{lag:.2f}' for lag in lags])} ms from the middle image to the prediction, in all {len(runs)} runs"
    )


def _seen(task: str, method: str, condition: str = "steady light") -> str:
    return percent(data("ball_detectors")[task][condition][method]["within"])


def _rms(method: str) -> str:
    return f"{data('ball_detectors')['train']['steady light'][method]['rms_px']:.2f} px"


def _point() -> str:
    error, jitter = (1e3 * _median(f"triangulation_{what}_m") for what in ("rms", "jitter"))
    return f"{error:.1f} mm rms (median run), of which {jitter:.1f} mm are jitter; the rest depends on the heading"


def _figure(number: str, *path: str) -> list[float]:
    """Returns a number of a figure of the 1991 paper, one value for each run of `benchmarks/paper_figures.py`."""
    found = data("paper_figures")
    uses(found)
    values = [run[f"figure_{number}"] for run in found["runs"]]
    for name in path:
        values = [value[name] for value in values]
    return values


def _limit() -> float:
    found = data("paper_figures")
    uses(found)
    return float(found["figure_15_error_at_a_cycle"])


def _span(values: list[float], form: str, factor: float = 1.0) -> str:
    return f"{factor * min(values):{form}} to {factor * max(values):{form}}"


def _jitter() -> str:
    along, across = (1e3 * statistics.median(_figure("07", f"jitter_{axis}_m")) for axis in ("tangential", "normal"))
    correlation = _figure("07", "jitter_correlation", "coefficient")
    return (
        f"{along:.2f} mm along the path, {across:.2f} mm across (medians of {len(correlation)} runs); correlation "
        f"{_span(correlation, '+.2f')}"
    )


def _bias() -> str:
    plain, recovered = (_figure("12", name) for name in ("bias_s_1", "bias_s_0"))
    bias, rest = (_span(values, ".1f", 100.0) for values in (plain, recovered))
    return f"s_1 is too long by {bias} %, s_0 by {rest} % ({len(plain)} runs)"


def _rice() -> str:
    distance = _figure("07", "kolmogorov_smirnov")
    return f"Kolmogorov-Smirnov distance {_span(distance, '.3f')} from the fitted density ({len(distance)} runs)"


def _laps() -> str:
    laps = data("tracking_arc_length")
    jerk = max(abs(each["hand_jerk_last_lap"] / each["hand_jerk_lap_2"] - 1.0) for each in laps)
    lost = sum(each["times_lost"] for each in laps)
    return (
        f"{min(each['laps'] for each in laps):.0f} laps in each direction, lost {lost} times; the jerk of the last lap "
        f"differs from that of lap 2 by at most {100 * jerk:.0f} %"
    )


def _against_cartesian() -> str:
    texts = []
    for path in ("stadium", "oval"):
        cell = where(data("estimation")["table"], cell=f"{path}-white-1-constant", horizon="grasp", stage="after")
        local, cartesian = (where(cell, contestant=name)[0]["rms_mm"] for name in ("arc_length", "alpha_beta_gamma"))
        texts.append(f"{local:.1f} against {cartesian:.1f} mm on the {path}")
    return f"rms error 0.75 s ahead with 1 mm of noise: {listed(texts)}"


def _loss() -> str:
    rows = where(lines("faults"), fault="link-bursts")
    uses(*rows)
    safe = sum(map(fault_tables.limits_kept, rows))
    lifted = [
        f"`{scenario}` {_successes([row for row in rows if fault_tables.scenario_of(row) == scenario])}"
        for scenario in sorted(set(map(fault_tables.scenario_of, rows)), key=fault_tables.RUNGS.index)
    ]
    return (
        f"80 % of the packets lost, 120 in a row: lifted {listed(lifted)}, no limit of the arm violated in {safe} of "
        f"{len(rows)}"
    )


def _hand() -> str:
    part = next(each for each in data("eyes_open") if each["part"] == "hand")
    uses(part)
    cells = [
        f"{cell['first_attempt']} of {cell['runs']} {cell['cell']}, {1e3 * cell['relative_m'][0]:.1f} mm off"
        for cell in part["cells"]
    ]
    return f"lifted at the first attempt with a wrong calibration, and median error: {listed(cells)}"


def _updates() -> str:
    part = next(each for each in data("eyes_open") if each["part"] == "hand")
    uses(part)
    without, marked = (f"{cell['measured']} times in {cell['runs']} runs" for cell in part["cells"])
    return (
        f"hand and object are measured in the same images: near the train, {marked} with markers, {without} without; "
        "the limit was the hardware of 1991"
    )


def _never_waits() -> str:
    rows = _balls("puma")
    uses(*rows)
    lags = {round(1e3 * row["lag_s"][end], 2) for row in rows for end in ("min", "max")}
    return (
        f"a set-point every {1e3 * BALL_SERVO_PERIOD:.0f} ms; {listed([f'{lag:.2f}' for lag in sorted(lags)])} ms from "
        f"stamp to prediction, the least and the greatest in {len(rows)} runs"
    )


def _successes(rows: list[Row]) -> str:
    uses(*rows)
    return f"{sum(bool(row['success']) for row in rows)} of {len(rows)}"


def _balls(cell: str) -> list[Row]:
    return where(lines("ball"), cell=cell)


def _ball_latency() -> str:
    puma, every = _balls("puma"), _balls("every image")
    lags = ["/".join(f"{lag:.2f}" for lag in balls.lags(rows)) for rows in (puma, every)]
    return (
        f"{lags[0]} ms from stamp to prediction, {lags[1]} ms with every image; caught {_successes(puma)} and "
        f"{_successes(every)}, which does not separate the two"
    )


def _located() -> str:
    tried = where(lines("ball_camera"), kind="locate")
    uses(*tried)
    found = where(tried, located=True)
    wrong = sum(map(camera.is_wrong, found))
    return f"the board was located from {len(found)} of {len(tried)} drawn poses, {wrong or 'none'} of them wrong"


def _pose(which: int) -> str:
    rows = lines("ball")
    uses(*rows)
    position, rotation, runs = list(balls.board_pose_errors(rows).values())[which]
    return f"{position:.2f} mm and {rotation:.3f} deg rms in {runs} runs"


def _flow_speeds() -> str:
    classes = data("ball_detectors")["by_speed"]["normal flow, set for the ball"]
    return (
        f"measured over true speed: {classes[1]['speed_ratio']:.2f} at 0.5 to 1 pixel, {classes[4]['speed_ratio']:.2f} "
        f"at 2 to 3; the position is found in {percent(classes[4]['within'])} of the images at 2 to 3 pixels"
    )


def _accepted() -> str:
    rows = _balls("puma")
    uses(*rows)
    share = statistics.median(balls.known(rows, "vision_valid_fraction"))
    return f"{percent(share)} of the measurements are accepted (median run)"


def _caught() -> str:
    rows = _balls("puma")
    return f"caught {_successes(rows)} ({interval(sum(bool(row['success']) for row in rows), len(rows))})"


_ALLEN: tuple[Claim, ...] = (
    ("A new coordinate every 1/60 s, 15 cycles or 0.25 s late", "3.1", _lag, HOLDS, _TRAIN),
    (
        "Normal velocities at strong gradients suffice",
        "3",
        lambda: (
            f"normal flow finds the train in {_seen('train', _FLOW)} of the images, dense DIS flow in "
            f"{_seen('train', 'DIS flow (OpenCV)')}"
        ),
        HOLDS,
        _BALL,
    ),
    (
        "Simple differencing is too noisy to locate motion",
        "3",
        lambda: (
            f"rms error {_rms(_DIFFERENCE)} with the difference and {_rms(_FLOW)} with normal flow, both with the "
            "centroid of the hull"
        ),
        REFUTED,
        _BALL,
    ),
    (
        "No special lighting, structure or reflectance is needed",
        "3, 7",
        lambda: f"{_rate('train', _LIGHTS)} in four looks and lights",
        HOLDS,
        _TRAIN,
    ),
    (
        "Velocities below 10 pixels per 60 ms are set to zero",
        "3.1",
        lambda: (
            f"at this threshold, the train is found in {_seen('train', 'normal flow, paper literal')} of the images, "
            "in which it moves 3 pixels per 60 ms; the default threshold is smaller"
        ),
        CHANGED,
        _BALL,
    ),
    ("The errors come from triangulation, shadows and different centroids", "3.1", _point, HOLDS, _VISION),
    (
        "The raw point serves gross tracking, not grasping",
        "3.1, 4",
        "the point is 0.25 s old, 38 mm at 0.15 m/s; the open jaws leave 24 mm",
        HOLDS,
        _TRAIN,
    ),
    (
        "Tangential and normal noise have equal dispersion and a correlation of 0.1 to 0.2",
        "4.1",
        _jitter,
        REFUTED,
        _FIGURES,
    ),
    (
        "Curvature is the limit of tan(phi_0) / s_0",
        "4.1, A",
        lambda: f"relative error at an interval of one cycle: {_limit():.1e}",
        HOLDS,
        _FIGURES,
    ),
    (
        "Measured arc lengths follow the Rice density",
        "4.2",
        _rice,
        HOLDS,
        _FIGURES,
    ),
    (
        "Averaging s is biased; equations 12 to 18 recover s_0 and sigma",
        "4.2, 6",
        _bias,
        HOLDS,
        _FIGURES,
    ),
    (
        "The mean of phi is phi_0",
        "4.2",
        "exact for the density of the paper, which omits points behind the object ([Errata](errata.md))",
        HOLDS,
        _TEST.format("rice"),
    ),
    (
        "Little on-line computation",
        "4.2",
        lambda: f"{data('estimation')['update_us']['arc_length'][0]:.0f} us for an update of the filter",
        HOLDS,
        _ESTIMATORS,
    ),
    (
        "A = 30 and a transition of 0.05 give a Kaiser window of order 30",
        "4.3",
        f"its own formula gives 30.7 ([Errata](errata.md)); the filter uses {kaiser_order(30.0, 0.05)}",
        CHANGED,
        _TEST.format("kaiser"),
    ),
    (
        "Prediction multiplies speed and bending by the time ahead",
        "4.1, 4.4",
        "replaced by a power of T_delta, which is exact on a circle",
        CHANGED,
        "[Differences](differences.md)",
    ),
    ("Local coordinates predict better than the Cartesian filter", "4, 4.1", _against_cartesian, HOLDS, _ESTIMATORS),
    ("The arm moves every 30 ms and bridges missed packets", "4.4", _loss, HOLDS, "[Faults](../results/faults.md)"),
    (
        "The transform equation gives Drive, a straight line that ends in contact",
        "5, figure 11",
        lambda: f"the jaws touch the train {1e3 * _median('touch_across_m'):.1f} mm beside its middle (median run)",
        HOLDS,
        "`tests/arm/motion/test_transform_equation.py`",
    ),
    (
        "The train runs at 10 to 20 cm/s on an oval that the system does not know",
        "6",
        lambda: _rate("train", PAPER_CELLS[:3]),
        HOLDS,
        _TRAIN,
    ),
    ("The motion is smooth, and tracking is stable over many revolutions", "6", _laps, HOLDS, _TRACKING),
    (
        "Joint 6 keeps the jaws on the tangent, so that the train can be grasped anywhere",
        "6",
        "no grasp begins while the jaws turn over, once a lap",
        CHANGED,
        "[Differences](differences.md)",
    ),
    (
        "The hand begins to close before contact",
        "5",
        lambda: (
            f"{-1e3 * _median('closing_onset_error_s'):.0f} ms before the last instant at which closing could succeed"
        ),
        HOLDS,
        _TRAIN,
    ),
    (
        "The train is intercepted, grasped stably and picked up; the system is repeatable",
        "6",
        lambda: _rate("train", PAPER_CELLS),
        HOLDS,
        _TRAIN,
    ),
    (
        "Other trajectories work as well",
        "6",
        lambda: (
            f"circle and stadium {_rate('train', PAPER_CELLS[3:])}; figure-eight up to 0.15 m/s "
            f"{_rate('train', ('figure_eight-0.10', 'figure_eight-0.15'))}, at 0.20 m/s "
            f"{_rate('train', ('figure_eight-0.20',))}"
        ),
        CHANGED,
        _TRAIN,
    ),
    (
        "Watching hand and object halves the rate of position updates",
        "7",
        _updates,
        REFUTED,
        "[Visual edge](visual_edge.md)",
    ),
    (
        "A window for the hand follows from its pose; both centroids update Drive",
        "7",
        _hand,
        HOLDS,
        "[Vision until contact](../results/eyes_open.md)",
    ),
    (
        "A wrist camera can take over near the object",
        "7",
        lambda: f"{_rate('train:wrist')} with `train:wrist`",
        HOLDS,
        _TRAIN,
    ),
    (
        "The method extends to a full Frenet frame",
        "4.1",
        _hills,
        HOLDS,
        "[The full Frenet frame](frenet.md)",
    ),
)
_NASHMAN: tuple[Claim, ...] = (
    (
        "Updates every 66.8 ms, throughput 100.2 ms; low latency of updates matters more than throughput",
        "4",
        _ball_latency,
        CHANGED,
        _BALL,
    ),
    (
        "Prim commands Servo every 5 ms; modules read the newest data and never wait",
        "2, 4",
        _never_waits,
        HOLDS,
        "`tests/grasp/ball`",
    ),
    ("The camera may stand anywhere as long as it sees the whole board", "3", _located, HOLDS, _BALL),
    ("Four circles and four coplanar points give the camera's pose", "3", lambda: _pose(0), HOLDS, _BALL),
    ("Three touches give the plane of the board in the world", "3", lambda: _pose(1), HOLDS, _BALL),
    (
        "A threshold cannot find a white ball on a white board",
        "4",
        lambda: f"found in {_seen('ball', 'static threshold')} of the images",
        HOLDS,
        _BALL,
    ),
    ("Normal flow loses a ball that moves by more than one pixel between images", "4", _flow_speeds, CHANGED, _BALL),
    (
        "The difference from a static image fails with flicker and vibration",
        "4",
        lambda: "found in {} with flicker, {} with a shaken camera, {} after a knock".format(
            *(
                _seen("ball", "background difference", name)
                for name in ("flicker 5 %, 100 Hz", "camera shaken", "board knocked")
            )
        ),
        HOLDS,
        _BALL,
    ),
    (
        "The difference of successive images isolates the ball",
        "4",
        lambda: "found in {} in steady light, {} with flicker, {} with a shaken camera".format(
            *(_seen("ball", _DIFFERENCE, name) for name in ("steady light", "flicker 5 %, 100 Hz", "camera shaken"))
        ),
        CHANGED,
        _BALL,
    ),
    (
        "The plane at half the ball's diameter is more precise than z = 0",
        "5",
        lambda: (
            "on z = 0 a ray ends one radius times the cotangent of its elevation too far: "
            f"{1e3 * BALL_RADIUS / math.tan(math.radians(50.0)):.0f} mm at 50 deg"
        ),
        HOLDS,
        "`tests/vision/centroid/test_plane_projection.py`",
    ),
    ("Points outside of the board and jumps are filtered out", "5", _accepted, HOLDS, _BALL),
    ("The predictions suffice to catch a ball that rolls at random", "5, 6", _caught, HOLDS, _BALL),
)
