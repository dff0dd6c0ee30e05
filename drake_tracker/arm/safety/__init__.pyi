from .packet_guard import REASONS as REASONS
from .packet_guard import PacketGuard as PacketGuard
from .packet_guard import Rejection as Rejection
from .packet_guard_system import PacketGuardSystem as PacketGuardSystem
from .packet_guard_system import make_packet_guard_system as make_packet_guard_system
