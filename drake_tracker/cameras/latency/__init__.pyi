from .code_reader import read_code as read_code
from .measurement import Latency as Latency
from .measurement import estimate_latency as estimate_latency
from .measurement import measure_by_code as measure_by_code
from .measurement import measure_by_light as measure_by_light
from .page_server import CodeServer as CodeServer
from .screen_code import draw_code as draw_code
