from .image_targets_system import ImageTargetsSystem as ImageTargetsSystem
from .stereo_tracks import ObjectPairing as ObjectPairing
from .stereo_tracks_system import ObjectPairsSystem as ObjectPairsSystem
