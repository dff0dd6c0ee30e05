from .controller_policy import ControllerPolicy as ControllerPolicy
from .dataset import DataSet as DataSet
from .environment import TrackerEnvironment as TrackerEnvironment
from .policies import POLICIES as POLICIES
from .policies import make_policy as make_policy
from .policy import Policy as Policy
from .policy import run_episode as run_episode
