"""The commands of ``drake-tracker``, one module each.

A module has ``register(commands)``, which adds its parser, and ``execute(options)``, which does the work and returns
the exit code. The modules load quickly: what the work needs is imported in ``execute``.
"""
