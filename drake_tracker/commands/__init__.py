"""The commands of ``drake-tracker``, one module each.

A module has ``register(commands)``, which adds its parser, and ``execute(options)``, which does the work and returns
the exit code. Options go in; files, text and the exit code come out. The modules load quickly: packages for the work
are imported in ``execute``. Begin with `common.py`, then `run.py`.
"""
