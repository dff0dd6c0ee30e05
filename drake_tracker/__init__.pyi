from .cameras.camera_model import CameraModel as CameraModel
from .campaign.run import run_campaign as run_campaign
from .core.errors import DrakeTrackerError as DrakeTrackerError
from .core.errors import DrakeTrackerWarning as DrakeTrackerWarning
from .core.log import load_log as load_log
from .core.messages import Prediction as Prediction
from .core.messages import evaluate_prediction as evaluate_prediction
from .diagrams.hand_eye import HandEyeDiagram as HandEyeDiagram
from .estimation.estimator import Estimator as Estimator
from .estimation.estimator import make_estimator as make_estimator
from .estimation.estimator_system import EstimatorSystem as EstimatorSystem
from .estimation.estimator_system import add_estimator as add_estimator
from .run.options import RunOptions as RunOptions
from .run.simulation import simulate as simulate
from .scenarios.base import BaseScenario as BaseScenario
from .tasks.loader import list_scenarios as list_scenarios
from .tasks.loader import load_scenario as load_scenario
from .tasks.loader import save_scenario as save_scenario
from .tasks.registry import initialise as initialise
from .tasks.registry import make_diagram as make_diagram
from .tasks.registry import task_of as task_of
from .vision.centroid.motion_centroid_system import add_motion_centroid as add_motion_centroid
from .vision.triangulator_system import add_triangulator as add_triangulator

__version__: str
