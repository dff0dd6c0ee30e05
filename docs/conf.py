"""Sphinx's settings: `make docs` builds these pages into docs/_build/html."""

import sys
from pathlib import Path

from drake_tracker import __version__

sys.path.insert(0, str(Path(__file__).parent / "_ext"))

project = "drake_tracker"
release = version = __version__
author = "The drake_tracker authors"
project_copyright = author
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "pydrake_system", "repository_files"]
exclude_patterns = ["_build"]

html_theme = "furo"
html_title = "drake_tracker"
html_static_path = ["_static"]
html_show_sphinx = False
html_copy_source = False

default_role = "code"
"""In docstrings a name between backticks is code."""
myst_heading_anchors = 3
autodoc_member_order = "bysource"
autodoc_typehints = "none"
autodoc_preserve_defaults = True
toc_object_entries = False
napoleon_use_param = False
