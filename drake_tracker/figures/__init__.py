"""The figures of Allen et al. 1991 drawn from this system, and one that the paper does not have: error over horizon.

For each figure one function returns its numbers as a dict, and one takes these numbers and returns a Matplotlib
`Figure`. `make_figures` calls all of them and writes the figures and their numbers to a directory.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
