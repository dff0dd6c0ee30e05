from .camera_calibration import calibrate_intrinsics as calibrate_intrinsics
from .camera_calibration import locate_camera as locate_camera
from .hand_eye_solver import HandEye as HandEye
from .hand_eye_solver import solve_hand_eye as solve_hand_eye
