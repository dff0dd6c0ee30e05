from .config import CatchConfig as CatchConfig
from .config import GraspConfig as GraspConfig
from .config import TouchConfig as TouchConfig
from .gate import Gate as Gate
from .motor_schema import Program as Program
from .motor_schema import SchemaMachine as SchemaMachine
from .motor_schema import SchemaState as SchemaState
from .operator_override import OperatorMode as OperatorMode
