"""Campaigns: many trials of a scenario, over seeds and a grid of settings, and how often they succeeded.

    grid ──cells──▶ plan ──trials──▶ pool or cluster ──results──▶ record ──▶ table, rates, plots

In Python::

    from drake_tracker import run_campaign
    campaign = run_campaign("train", trials=4, vary={"track.speed": [0.1, 0.2]}, vision="measured", workers=2)
    for rate in campaign.rates:
        print(rate.settings, rate.taken, rate.trials, rate.low, rate.high)
"""
