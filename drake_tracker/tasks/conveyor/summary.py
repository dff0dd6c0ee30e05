"""The summary of a run of the conveyor: how many parts were picked and placed, how well, and why others were not."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from drake_tracker.core.messages import PickVerdict
from drake_tracker.core.part_kinds import PART_SHAPES
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.tasks.arm_limits import arm_findings, limits_of
from drake_tracker.tasks.conveyor.lost_parts import counted, lost_parts
from drake_tracker.tasks.conveyor.part_history import part_histories
from drake_tracker.tasks.conveyor.setup import ConveyorSetup
from drake_tracker.tasks.conveyor.windows import clairvoyant_picks, could_be_picked
from drake_tracker.tasks.episode import Log
from drake_tracker.tasks.results import lag_of, last_message, limiter_findings, made_by, packet_findings, tidy
from drake_tracker.world.conveyor.arrivals import Arrival
from drake_tracker.world.conveyor.part_fates import PartFate

ENOUGH = 0.9
"""Share of the parts that could be picked which a successful run places."""
_COUNTS = ("arrived", "picked", "placed", "missed", "dropped", "doubles")
_TOUCHES = ("belt_touched", "tray_touched", "table_touched", "self_touched")


def summarise_conveyor(
    setup: ConveyorSetup,
    arrivals: Sequence[Arrival],
    log: Log,
    simulated: float,
    interrupted: bool = False,
) -> dict[str, Any]:
    """Returns the summary of a run, a dict of numbers, texts and None (where a value does not exist).

    Lengths are in m, times in s, angles in rad:

    - ``success``: whether at least `ENOUGH` of the parts that could be picked were placed.
    - ``could_be_picked``: number of parts that the belt carried, or would have carried, to the end of the picking
      window so early that the arm could still have put them into the farthest cell before the end of the run, as the
      dispatcher predicts it (`placing_time`).
    - ``placed_of_these``: number of them that were placed.
    - ``arrived``, ``picked``, ``placed``, ``missed``, ``dropped``, ``doubles``: see `PickVerdict`.
    - ``picks_per_minute``: parts picked, divided by the length of the run.
    - ``misplaced``: number of the placed parts whose direction is wrong by more than 10 deg, or which reach out of
      their cells, see `Placement`.
    - ``placement_rms_m``, ``placement_turn_rms_rad``: distance of the placed parts from the middles of their cells, and
      angle from the ordered direction modulo the symmetry of their kind. Discs have no direction.
    - ``share_of_clairvoyant``: parts picked, divided by the most that an arm could have picked that knows all arrivals,
      see `clairvoyant_picks`; not for a belt that changes its speed. The times of the model are means: a run with a
      few short ways can exceed 1.
    - ``missed_because``: {cause: number} of the parts that arrived and were never picked, see `lost_parts`.
    - ``lost_parts``: ``sentences`` with the cause for each part that arrived and was not placed.
    - ``belt_touched``, ``tray_touched``, ``table_touched``, ``self_touched``: whether the arm touched the belt, a tray,
      table or floor, or itself.
    - ``joint_limit_margin_rad``, ``speed_share``, ``longest_saturation_s``: see `arm_findings`.
    - ``packets_rejected``, ``packets_rejected_for``: see `packet_findings`.
    - ``set_points_changed``, ``set_points_changed_for``: see `limiter_findings`.
    - ``encoder_unused_s``: time in which the host went on with vision alone, because the encoder was silent, had
      jumped, or disagreed with vision; None without an encoder.
    - ``lag_s``: smallest and greatest time from the stamp of an image to the packet based on it.

    Args:
        setup: the resolved scenario of the run.
        arrivals: the parts of the run.
        log: {name: Signal} of the run.
        simulated: time at which the run ended [s].
        interrupted: whether the user ended the run.
    """
    histories = part_histories(setup, arrivals, log)
    verdict = last_verdict(log)
    possible = [part for part in histories if could_be_picked(setup, part.arrival, simulated)]
    placed = sum(part.fate is PartFate.PLACED for part in possible)
    success = bool(possible) and placed >= ENOUGH * len(possible)
    put_down = [(part.arrival.kind, part.placement) for part in histories if part.placement is not None]
    placements = [placement for _, placement in put_down]
    turns = [placement.turn for kind, placement in put_down if PART_SHAPES[kind].turns > 0]
    lost = lost_parts(setup, histories, log, simulated)
    reasons = counted([part for part in lost if histories[part.number - 1].picked_at is None])
    bound = clairvoyant_picks(setup, arrivals, simulated)
    summary = {
        "scenario": setup.scenario.name,
        "seed": setup.scenario.seed,
        "success": success,
        "failure_reason": None if success else failure_reason(verdict, len(possible), placed, reasons, interrupted),
        "could_be_picked": len(possible),
        "placed_of_these": placed,
        "picks_per_minute": 60.0 * verdict.picked / simulated if simulated > 0.0 else None,
        **{name: int(getattr(verdict, name)) for name in _COUNTS},
        "misplaced": sum(placement.wrong for placement in placements),
        "placement_rms_m": _rms([placement.error for placement in placements]),
        "placement_turn_rms_rad": _rms(turns),
        "share_of_clairvoyant": int(verdict.picked) / bound if bound else None,
        "missed_because": reasons,
        "lost_parts": {"sentences": [part.sentence for part in lost]},
        **{name: bool(getattr(verdict, name)) for name in _TOUCHES},
        **arm_findings(log, limits_of(setup.arm)),
        **packet_findings(log),
        **limiter_findings(log),
        "encoder_unused_s": _encoder_unused(log),
        "lag_s": lag_of(log, setup.scenario.time_step),
        "simulated_s": simulated,
        "interrupted": bool(interrupted),
        **made_by(),
    }
    return tidy(summary)


def last_verdict(log: Log) -> Any:
    """Returns the last `PickVerdict` of a log, all zeros when there is none."""
    return last_message(log["truth_verdict"], PickVerdict)


def failure_reason(verdict: Any, possible: int, placed: int, reasons: dict[str, int], interrupted: bool) -> str:
    """Returns in one sentence why a run did not succeed.

    Args:
        verdict: the last `PickVerdict` of the run.
        possible: number of parts that could be picked.
        placed: number of them that were placed.
        reasons: {cause: number} of the parts that were never picked.
        interrupted: whether the user ended the run.
    """
    if not possible:
        reason = f"no part had left the window ({int(verdict.placed)} placed), so the run was too short to judge"
    else:
        reason = f"{placed} of {possible} parts that could be picked were placed, less than {100.0 * ENOUGH:.0f} %"
        losses = {"dropped": int(verdict.dropped), **reasons}
        details = [f"{count} {what}" for what, count in losses.items() if count]
        if details:
            reason += f" ({', '.join(details)})"
    return f"interrupted; until then {reason}" if interrupted else reason


def _encoder_unused(log: Log) -> float | None:
    report = log.get("encoder_report")
    return None if report is None else VISION_PERIOD * float(report["unused_cycles"].max(initial=0.0))


def _rms(values: Sequence[float]) -> float | None:
    return float(np.sqrt(np.mean(np.square(values)))) if values else None
