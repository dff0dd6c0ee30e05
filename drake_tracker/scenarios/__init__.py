"""Reading of scenario files.

The YAML text of a scenario goes in; out comes an instance of a frozen dataclass of settings, or a list of all that is
wrong with the text, one line per problem with file and line. The dataclasses of the tasks' scenarios derive from
`BaseScenario`; `Custom` stands for a part that the user wrote. Begin with `tree.py`, then `reader.py`;
`drake_tracker.tasks.load_scenario` finds the files and puts the steps together.

    text ──tree.parse──▶ Value tree ──tree.merge──▶ one tree ──reader.read──▶ scenario
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
