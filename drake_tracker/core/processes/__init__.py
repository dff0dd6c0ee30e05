"""Threads, child processes, signals, and servers on this machine.

Work goes in; it is done beside the main thread, in order, and ends with it. Begin with `worker_pool.py` for many tasks,
`child_process.py` for one process, `worker_thread.py` for one thread, `loopback_server.py` for a page in the browser,
and `signals.py` for Ctrl-C.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
