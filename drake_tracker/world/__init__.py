"""The simulated laboratories, the only subsystem that knows the ground truth.

In go set-points of the joints and of the gripper, and whether the arm is ready for the ball. Out come camera images,
joint states and drive efforts, which the controller may read, and the ``truth_*`` ports, which only judges, logs and
viewers may read. `WorldDiagram` is the laboratory of the train, `BallWorldDiagram` the laboratory of the ball,
`ConveyorWorldDiagram` the laboratory of the conveyor. Each ``add_*`` function adds one part to any plant or diagram.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
