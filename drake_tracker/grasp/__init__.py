"""Motor schemas: what the hand does next.

In go what the arm's computer knows at each tick: the estimated object (`ServoTarget`), the packet of predicted path on
which it rests (`Prediction`), where the tool is (`ToolStatus`), what the hand measures (`JawState`) and what the
operator wants (`OperatorCommand`). Out come the motion to make (`ArmCommand`) and the reason for it (`GraspDiagnosis`,
`PickDiagnosis`, `CatchDiagnosis`). Begin with `motor_schema.py`, then the folder of
a task: `train`, `ball` or `conveyor`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
