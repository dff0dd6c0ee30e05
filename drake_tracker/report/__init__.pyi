from .page import page_of as page_of
from .run_files import RunFiles as RunFiles
from .run_files import read_run as read_run
from .server import make_server as make_server
