"""Samples the content of the live view from above, as a Drake System."""

from collections.abc import Callable
from typing import Any

import numpy as np
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, LeafSystem

from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.tasks.strips import Overview

SAMPLE_PERIOD = 6 * VISION_PERIOD
"""Simulated time between two samples [s]: 10 a second."""


class OverviewSystem(LeafSystem):
    """Passes the values of an `Overview` to the live view every `SAMPLE_PERIOD`.

    .. pydrake_system::

        name: OverviewSystem
        input_ports:
        - arm_state
        - (the ports of the overview)

    ``arm_state``: positions [rad] and velocities [rad/s] of the joints. There are no output ports: the System reads
    ground truth and feeds nothing back into the loop.

    Args:
        overview: what is read and shown.
        sizes: {port of the overview: number of its elements}.
        model: `ArmModel` used for the tool position.
        show: called with the values, a dict for JSON.
    """

    def __init__(
        self, overview: Overview, sizes: dict[str, int], model: Any, show: Callable[[dict[str, Any]], object]
    ) -> None:
        super().__init__()
        self._overview, self._model, self._show = overview, model, show
        self._arm_state = self.DeclareVectorInputPort("arm_state", 2 * model.num_joints)
        self._ports = {name: self.DeclareVectorInputPort(name, size) for name, size in sizes.items()}
        self.DeclarePeriodicPublishEvent(SAMPLE_PERIOD, 0.0, self._publish)

    def _publish(self, context: Context) -> None:
        p_WT = self._model.tool_pose(self._arm_state.Eval(context)[: self._model.num_joints]).translation()
        read = {}
        for name, port in self._ports.items():
            view, vector = self._overview.ports[name], np.array(port.Eval(context))
            read[name] = vector if view is None else view(vector)
        self._show(self._overview.values(context.get_time(), p_WT, read))


def add_overview(
    builder: DiagramBuilder,
    *,
    hand_eye: Diagram,
    overview: Overview,
    model: Any,
    show: Callable[[dict[str, Any]], object],
) -> OverviewSystem:
    """Adds an `OverviewSystem` and connects it to a `HandEyeDiagram` of the same builder.

    Args:
        builder: receives the System.
        hand_eye: diagram with the output ports that the System reads.
        overview: what is read and shown.
        model: `ArmModel`, as in `OverviewSystem`.
        show: as in `OverviewSystem`.
    """
    sizes = {name: hand_eye.GetOutputPort(name).size() for name in overview.ports}
    system = builder.AddNamedSystem("live_overview", OverviewSystem(overview, sizes, model, show))
    for name in ("arm_state", *sizes):
        builder.Connect(hand_eye.GetOutputPort(name), system.GetInputPort(name))
    return system
