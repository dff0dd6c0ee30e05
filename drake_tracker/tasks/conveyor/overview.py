"""The belt from above on the live page: the parts with their identities, the queue, the hand and the cells."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from drake_tracker.core.messages import (
    BELT_FIELDS,
    ArmCommand,
    BeltEstimate,
    PickDiagnosis,
    PickOrder,
    ToolStatus,
    message_rows,
)
from drake_tracker.core.part_kinds import PART_SHAPES, PartKind, part_outline
from drake_tracker.tasks.conveyor.scenario import ConveyorScenario
from drake_tracker.tasks.strips import Overview
from drake_tracker.world.conveyor.conveyor_config import cell_centres

_STATE_SIZE = 13
_BEYOND = 0.06
"""Distance beyond belt and trays up to which the page shows them [m]."""


def conveyor_overview_facts(scenario: ConveyorScenario, hand_eye: Any) -> dict[str, Any]:
    """Returns the parts of the picture that stand still, and the outlines of the parts.

    Args:
        scenario: the scenario.
        hand_eye: diagram of the scenario, whose world has the parts of the run.
    """
    belt, window, centres = scenario.belt, scenario.window, cell_centres(scenario.tray)
    half = 0.5 * belt.width
    low = min(belt.entry, centres[:, 1].min() - 0.5 * scenario.tray.pitch) - _BEYOND
    high = max(belt.end, centres[:, 1].max() + 0.5 * scenario.tray.pitch) + _BEYOND
    return {
        "x": [round(float(centres[:, 0].min()) - scenario.tray.pitch, 3), belt.middle + half + 0.03],
        "y": [round(float(low), 3), round(float(high), 3)],
        "belt": [belt.middle - half, belt.middle + half],
        "window": [window.y_first, window.y_last],
        "end": belt.end,
        "cell": scenario.tray.cell,
        "cells": centres.round(4).tolist(),
        "min_clear": scenario.eligibility.min_clear,
        "outlines": {int(kind): part_outline(kind).round(4).tolist() for kind in PART_SHAPES},
        "names": {int(kind): PartKind(kind).name.lower() for kind in PART_SHAPES},
        "parts": [[int(arrival.kind), arrival.colour] for arrival in hand_eye.world.arrivals],
    }


def conveyor_overview_values(now: float, p_WT: np.ndarray, read: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the places of parts and hand, and the activity of the hand.

    ``seen`` are the parts as the host estimates them: [number, kind, x, y, yaw, room beside it]. ``true`` are all parts
    within the picture: [index, x, y, yaw].

    Args:
        now: simulated time [s].
        p_WT: position of the tool in W, shape (3,) [m].
        read: {port: message} of `CONVEYOR_OVERVIEW`.
    """
    diagnosis, order = read["diagnosis"], read["order"]
    states = np.reshape(read["truth_part_states"], (-1, _STATE_SIZE))
    yaw = np.arctan2(
        2.0 * (states[:, 0] * states[:, 3] + states[:, 1] * states[:, 2]),
        states[:, 0] ** 2 + states[:, 1] ** 2 - states[:, 2] ** 2 - states[:, 3] ** 2,
    )
    near = np.flatnonzero(np.abs(states[:, 5]) < 1.0)
    seen = [
        [int(row[0]), int(row[1]), *(round(float(row[k]), 4) for k in (2, 3, 5, 9))]
        for row in message_rows(np.asarray(read["belt"][:]), BELT_FIELDS)
        if row[0] > 0
    ]
    picked = int(diagnosis.picked)
    return {
        "seen": seen,
        "true": [[int(k), *(round(float(v), 4) for v in (states[k, 4], states[k, 5], yaw[k]))] for k in near],
        "hand": [
            *(round(float(v), 4) for v in (p_WT[0], p_WT[1], read["status"].yaw)),
            round(float(read["command"].jaw_width), 4),
        ],
        "order": int(order.number) if order.valid else 0,
        "cell": int(order.cell) if order.valid and order.number else None,
        "picked": picked,
        "placed": int(diagnosis.placed),
        "failed": int(diagnosis.failed),
        "per_minute": round(60.0 * picked / now, 1) if now > 0.0 else 0.0,
    }


CONVEYOR_OVERVIEW = Overview(
    ports={
        "belt": BeltEstimate,
        "order": PickOrder,
        "diagnosis": PickDiagnosis,
        "command": ArmCommand,
        "status": ToolStatus,
        "truth_part_states": None,
    },
    facts=conveyor_overview_facts,
    values=conveyor_overview_values,
)
"""The belt from above."""
