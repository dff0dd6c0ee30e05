from .grasp_machine import GraspMachine as GraspMachine
from .grasp_machine import GraspObservation as GraspObservation
from .grasp_system import GraspSystem as GraspSystem
from .schema import Phase as Phase
