"""The hand as cameras see it: its markers, the silhouette of the arm, and the camera on the wrist.

Images and joint angles go in. Out come the measured displacement of the hand (`HandMarkersSystem`), the pixels that
the arm covers (`ArmSilhouetteSystem`), and the object in front of the hand (`WristViewSystem`). Begin with
`hand_markers.py` for markers and `wrist_view.py` for the camera on the wrist.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
