"""How well the jaws were timed and placed, judged from truth after the run."""

from typing import NamedTuple

import numpy as np

from drake_tracker.diagrams.train_track import draw_track
from drake_tracker.grasp.gate import touch_delay
from drake_tracker.grasp.schema import Phase
from drake_tracker.record.episode import errors, phase_spans, tool_pose, train_pose
from drake_tracker.timing import KNOT_END
from drake_tracker.world.speed_law import distance_at

REACH_ALONG = 0.05
"""Distance [m] along the jaws' faces by which the middle of the train may be off and is still gripped."""
