"""Sphinx configuration: `make docs` builds the pages into docs/_build/html."""

import sys
from pathlib import Path

from drake_tracker import __version__

sys.path.insert(0, str(Path(__file__).parent / "_ext"))

project = "drake_tracker"
release = version = __version__
author = "The drake_tracker authors"
project_copyright = author
extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_design",
    "package_reference",
    "pydrake_system",
    "repository_files",
]
exclude_patterns = ["_build"]

html_theme = "furo"
html_title = "drake_tracker"
html_static_path = ["_static"]
html_show_sphinx = False
html_copy_source = False

default_role = "code"
"""In docstrings, text between single backticks is code."""
myst_heading_anchors = 3
myst_enable_extensions = ["colon_fence"]
highlight_language = "none"
nb_execution_mode = "off"
"""The notebooks are stored with their output."""
autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
python_use_unqualified_type_names = True
autodoc_preserve_defaults = True
toc_object_entries = False
napoleon_use_param = True
napoleon_use_ivar = True
