from .calibration_file import load_calibration as load_calibration
from .calibration_file import save_calibration as save_calibration
