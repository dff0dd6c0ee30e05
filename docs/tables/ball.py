"""Caught balls (`results/ball.jsonl`), the poses of their camera (`results/ball_camera.jsonl`), and the ball's
detectors (`results/ball_detectors.json`)."""

import math
import statistics

import ball as benchmark
import ball_camera as camera
from ball_detectors import IN_SHORT
from methods.detector_methods import DEFAULT, FLOW_LITERAL, MOG2
from result_tables import ball_detector_tables as detectors

from tables.results import block, commit_of, data, lines, listed, of, origin, ranges, table, where

_IN_SHORT = {name: name for name in IN_SHORT}
"""Rows of the short table: label, name in the result file."""


def ball_cells() -> str:
    rows = lines("ball")
    return block(table(*benchmark.cells_table(rows, list(benchmark.CELLS))), origin(rows))


def ball_summary() -> str:
    texts = []
    for cell, arm in (("puma", "the PUMA 560"), ("seven_joint", "the seven-joint arm")):
        rows = where(lines("ball"), cell=cell)
        texts.append(f"{arm} caught {of(sum(bool(row['success']) for row in rows), len(rows), ' balls')}")
    return f"{texts[0][0].upper()}{texts[0][1:]}, {texts[1]}."


def ball_board_pose() -> str:
    found = benchmark.board_pose_errors(lines("ball")).values()
    rows = [
        [label, f"{position:.2f} mm", f"{rotation:.3f} deg", runs]
        for label, (position, rotation, runs) in zip(("by camera", "by touch"), found)
    ]
    return table(["board located", "position error, rms", "rotation error, rms", "runs"], rows)


def ball_limits() -> str:
    rows = lines("ball")
    accepted = statistics.median(benchmark.known(rows, "vision_valid_fraction"))
    touched = sum(bool(row["board_touched"]) for row in rows)
    arms = {}
    for cell in ("puma", "seven_joint"):
        runs = where(rows, cell=cell)
        arms[cell] = listed([f"{lag:.2f}" for lag in benchmark.lags(runs)])
    puma = 1e3 * max(row["longest_saturation_s"] for row in rows if row["cell"] != "seven_joint")
    seven = 1e3 * max(row["longest_saturation_s"] for row in where(rows, cell="seven_joint"))
    every = listed([f"{lag:.2f}" for lag in benchmark.lags(where(rows, cell="every image"))])
    lag = arms["puma"] if arms["puma"] == arms["seven_joint"] else listed(list(arms.values()))
    return (
        f"While the ball rolls, {100 * accepted:.0f} % of its measurements are accepted (median of the runs). The time "
        f"from a measurement's stamp, midway between its two images, to the prediction built on it is {lag} ms in "
        f"every run with either arm, and {every} ms with every image used. The arm touched the board in "
        f"{touched or 'none'} of {len(rows)} runs. The longest saturation of a drive was {puma:.0f} ms with the PUMA "
        f"560, {seven:.0f} ms with the seven-joint arm."
    )


def ball_failures() -> str:
    failed = [row for row in lines("ball") if not row["success"] and row["cell"] != "stays in the middle"]
    rows = [[row["cell"], row["seed"], f"`{commit_of(row)}`", row["failure_reason"]] for row in failed]
    return table(["cell", "seed", "commit", "reason"], rows)


def ball_camera_locate() -> str:
    rows = where(lines("ball_camera"), kind="locate")
    return block(table(*camera.locate_table(rows)), origin(rows))


def ball_camera_wrong() -> str:
    rows = where(lines("ball_camera"), kind="locate", located=True)
    wrong = [row for row in rows if camera.is_wrong(row)]
    largest = max(row["position_m"] for row in rows)
    return (
        f"Of {len(rows)} located boards, {len(wrong) or 'none'} {'is' if len(wrong) == 1 else 'are'} more than "
        f"{1e3 * camera.WRONG_POSITION:.0f} mm or {math.degrees(camera.WRONG_ROTATION):.0f} deg from the truth; the "
        f"largest error is {1e3 * largest:.1f} mm."
    )


def ball_camera_catch() -> str:
    rows = where(lines("ball_camera"), kind="catch")
    return block(table(*camera.catch_table(rows)), origin(rows))


def _detectors_origin() -> str:
    found = data("ball_detectors")
    seeds = f"Seeds of the ball {ranges(found['seeds'])}, of the train {found['train_seed']}"
    return f"*{seeds}, commit `{found['made_by']['commit'][:7]}`.*"


def ball_detectors() -> str:
    found = data("ball_detectors")
    images = [found[task]["steady light"][DEFAULT]["images"] for task in ("ball", "train")]
    text = f"{images[0]} images of the ball, {images[1]} of the train."
    return block(table(*detectors.short_table(found, _IN_SHORT, DEFAULT)), text, _detectors_origin())


def ball_detectors_both_tasks() -> str:
    found = data("ball_detectors")
    text = f"The default takes {found['time_us'][DEFAULT]:.0f} us per image."
    return block(table(*detectors.both_tasks_table(found, DEFAULT)), text)


def ball_detectors_conditions() -> str:
    return table(*detectors.conditions_table(data("ball_detectors")["ball"]))


def ball_detectors_conditions_train() -> str:
    return table(*detectors.conditions_table(data("ball_detectors")["train"]))


def ball_detectors_speed() -> str:
    return table(*detectors.speeds_table(data("ball_detectors")["by_speed"]))


def ball_detectors_literal() -> str:
    found = data("ball_detectors")
    counts = []
    for task in ("ball", "train"):
        row = found[task]["steady light"][FLOW_LITERAL]
        counts.append(f"{round(row['within'] * row['images'])} of {row['images']} images of the {task}")
    return f"The literal preset finds the object in {listed(counts)}; its errors are those of these few images."


def ball_detectors_mog2() -> str:
    times = data("ball_detectors")["time_us"]
    ratio = times[MOG2] / times[DEFAULT]
    return f"The default is {ratio:.1f} times as fast as MOG2; the target was 5."
