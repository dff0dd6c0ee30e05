"""Drake System of the link."""

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import LeafSystem

from drake_tracker.core.messages import Prediction, message_size
from drake_tracker.core.timing import LINK_SLOT, TIME_STEP, VISION_PERIOD, vision_slot
from drake_tracker.link.lossy_link import LinkState, LossyLink, newest_arrived


class LossyLinkSystem(LeafSystem):
    """A mailbox: what is put in at 60 Hz comes out once it has arrived, and only ever makes way for something newer.

    .. pydrake_system::

        name: LossyLinkSystem
        input_ports:
        - packet
        output_ports:
        - delivered

    Both ports carry a `messages.Prediction`. The input is read every 1/60 s in the link's slot, after the estimator's;
    the output, all zeros until a first packet arrives, may change at any time in between and has no direct feedthrough.
    """

    def __init__(self, *, drop=0.0, delay=0.0, jitter=0.0, burst=1.0, seed=0, time_step=TIME_STEP):
        """The faults are those of `lossy_link.LossyLink`; ``time_step`` [s] is the plant's.

        Raises DrakeTrackerError when one of them is out of range.
        """
        LeafSystem.__init__(self)
        self._link = LossyLink(drop=drop, delay=delay, jitter=jitter, burst=burst, seed=seed)
        size = message_size(Prediction)
        self._nothing = np.zeros(size)
        self._nothing.flags.writeable = False
        self._packet = self.DeclareVectorInputPort("packet", size)
        self._state_index = self.DeclareAbstractState(AbstractValue.Make(LinkState()))
        self.DeclareVectorOutputPort(
            "delivered",
            size,
            self._calc_delivered,
            prerequisites_of_calc={self.abstract_state_ticket(self._state_index), self.time_ticket()},
        )
        self.DeclarePeriodicUnrestrictedUpdateEvent(VISION_PERIOD, vision_slot(LINK_SLOT, time_step), self._post)

    def _post(self, context, state):
        memory = context.get_abstract_state(self._state_index).get_value()
        posted = self._link.post(memory, self._packet.Eval(context), context.get_time())
        state.get_mutable_abstract_state(self._state_index).set_value(posted)

    def _calc_delivered(self, context, output):
        memory = context.get_abstract_state(self._state_index).get_value()
        packet = newest_arrived(memory, context.get_time())
        output.SetFromVector(self._nothing if packet is None else packet)
