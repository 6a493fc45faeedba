"""Sphinx configuration: MyST pages and notebooks, the furo theme, the API from its docstrings."""

import os
from importlib import metadata
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

project = "sdpd"
author = "The sdpd developers"
project_copyright = f"2026, {author}"
release = metadata.version("sdpd")
version = ".".join(release.split(".")[:2])

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.mathjax",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
]
# docs/generated holds tables that pages include; they are no pages of their own
exclude_patterns = ["_build", "**.ipynb_checkpoints", "generated", "jupyter_execute"]
templates_path = ["_templates"] if (ROOT / "docs" / "_templates").is_dir() else []

myst_enable_extensions = ["amsmath", "attrs_inline", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 4
# Labels such as `(ref-yang2013)=` are linked as `#ref-yang2013` from any page.
# Numpydoc numbers the references of every docstring from [1], which docutils takes for duplicates;
# names such as `velocities` are attributes of more than one class.
suppress_warnings = ["docutils", "mystnb.unknown_mime_type", "ref.python"]

# `make docs` shows pages and notebooks as they are; SDPD_DOCS_EXECUTE=1 runs the notebooks first.
nb_execution_mode = "cache" if os.environ.get("SDPD_DOCS_EXECUTE") else "off"
nb_execution_timeout = 600
nb_execution_raise_on_error = True

autosummary_generate = True
autodoc_member_order = "bysource"
autodoc_typehints = "none"
autodoc_default_options = {"members": True, "show-inheritance": True}
napoleon_google_docstring = False
napoleon_numpy_docstring = True
napoleon_use_rtype = False
napoleon_use_ivar = True

html_theme = "furo"
html_title = f"sdpd {release}"
html_static_path = ["_static"] if (ROOT / "docs" / "_static").is_dir() else []
