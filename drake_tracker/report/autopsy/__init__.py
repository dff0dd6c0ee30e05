"""What became of each attempt of a run of the train, and which stage of the chain from camera to jaws was to blame.

Everything here is arithmetic on the log of a run; `autopsy.perform` is the way in.
"""
