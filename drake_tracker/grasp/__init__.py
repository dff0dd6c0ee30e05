"""Motor schemas: what the hand does next.

The inputs at each tick are the estimated object (`ServoTarget`), the packet of predicted path on which it rests
(`Prediction`), the state of the tool (`ToolStatus`), the measurement of the gripper (`JawState`) and the command of the
operator (`OperatorCommand`). The outputs are the motion to make (`ArmCommand`) and the reason for it (`GraspDiagnosis`,
`PickDiagnosis`, `CatchDiagnosis`). Begin with `motor_schema.py`, then the folder of a task: `train`, `ball` or
`conveyor`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
