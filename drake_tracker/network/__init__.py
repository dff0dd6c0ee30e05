"""The network between the process of the host and the process of the arm.

In go the ports of a hand-eye diagram: vectors with named fields, and images. The output is LCM messages on one channel
for each port, and the same ports in the other process. `HostSideDiagram` and `ArmSideDiagram` are the two processes as
Diagrams; `open_bus` joins the bus, and `Mailbox` and `CycleCollector` collect incoming messages.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
