"""The figures of Allen et al. 1991 drawn from this system, and the one that the paper lacks: error against horizon.

Each figure has a function that returns its numbers as a dict, and one that draws them and returns a Matplotlib
`Figure`; `drake_tracker.figures.command.make_figures` calls them all.
"""
