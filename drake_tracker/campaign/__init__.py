"""Campaigns: many trials of a scenario, over seeds and a grid of settings, and their success rates.

A scenario and values of some of its settings go in; a `Campaign` comes out: one line per trial with the summary of its
run, a table of all trials, the success rate of each combination with its 95 % Wilson interval, and a plot of the rates.

    grid ──cells──▶ plan ──trials──▶ pool or cluster ──results──▶ directory ──▶ table, rates, plots

Begin with `run.py`, which takes these steps in their order.

In Python::

    from drake_tracker import run_campaign
    campaign = run_campaign("train", trials=4, vary={"track.speed": [0.1, 0.2]}, vision="measured", workers=2)
    for rate in campaign.rates:
        print(rate.settings, rate.successes, rate.trials, rate.low, rate.high)
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
