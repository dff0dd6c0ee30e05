from .footage import Footage as Footage
from .frame_clock import FrameClock as FrameClock
from .frame_sequence import FrameSequence as FrameSequence
from .frame_sequence import Tick as Tick
from .sources import open_footage as open_footage
from .timeline import Timeline as Timeline
from .timeline import align as align
from .video_source_system import VideoSource as VideoSource
