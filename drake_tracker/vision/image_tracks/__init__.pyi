from .image_tracker_system import ImageTargetsSystem as ImageTargetsSystem
from .stereo_tracks import StereoTracker as StereoTracker
from .stereo_tracks_system import StereoTracksSystem as StereoTracksSystem
