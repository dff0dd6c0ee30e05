from .diagnosis import perform as perform
from .evidence import Attempt as Attempt
from .evidence import Evidence as Evidence
from .evidence import TrackingEvidence as TrackingEvidence
from .stages import Stage as Stage
