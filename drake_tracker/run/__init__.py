"""Runs of a scenario: simulation, recorders, and the process of the host.

`simulate` runs a scenario; `RunOptions` select what is shown and recorded. Out come the summary of the run, a dict, and
the run directory: the summary, the log, the scenario, pictures, the camera video and the 3-D recording. `HostProcess`
runs vision and estimator in a separate process, driven by messages of the arm's process.

    scenario ──▶ diagram ──▶ simulation ──▶ log ──▶ summary, pictures
                                 └──▶ recorders ──▶ video, 3-D recording, images
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
