"""The commands of ``drake-tracker``, a module each.

A module has ``register(commands)``, which adds its parser, and ``execute(options)``, which does the job and returns the
exit code. Modules load quickly: what a job needs is imported when it is done.
"""
