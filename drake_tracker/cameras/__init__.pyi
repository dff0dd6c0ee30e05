from .camera_model import CameraModel as CameraModel
from .triangulation import RayIntersection as RayIntersection
from .triangulation import triangulate as triangulate
