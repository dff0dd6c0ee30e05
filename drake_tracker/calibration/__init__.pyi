from .board_page import parse_board as parse_board
from .measure_vision import measure as measure
from .photographs import calibrate_photographs as calibrate_photographs
from .rendered_boards import CameraCalibration as CameraCalibration
from .rendered_boards import calibrate as calibrate
from .rendered_boards import calibrate_cameras as calibrate_cameras
from .rendered_boards import calibration_error as calibration_error
from .wrist_boards import calibrate_wrist as calibrate_wrist
