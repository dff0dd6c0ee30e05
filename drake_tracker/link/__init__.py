"""The link from the host to the arm.

The input is the host's packets of predicted path (`drake_tracker.core.messages.Prediction`); the output is the packets
that arrive at the arm's controller, at their times of arrival. Begin with `link.py`: a link is an object with three
methods (`Link`), `LINKS` registers the kinds, and `LinkSystem` makes a System of one.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
