from .custom import make_custom as make_custom
from .hand_eye import HandEyeDiagram as HandEyeDiagram
from .hand_eye import connect as connect
from .parts import arm_of as arm_of
from .parts import check_arm as check_arm
from .parts import check_custom_parts as check_custom_parts
from .parts import estimator_of as estimator_of
from .parts import make_host as make_host
