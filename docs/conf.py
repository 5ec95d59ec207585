"""The site: `sphinx-build -W --keep-going docs dist/site` builds it; it needs the extra docs, and no network."""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))
os.environ.setdefault("OMP_NUM_THREADS", "1")  # as on the machines whose results are shown
# Notebooks import modules that they have written, and print what a terminal without colours would show.
os.environ["PYTHONPATH"] = os.pathsep.join([*filter(None, [os.environ.get("PYTHONPATH")]), "."])
_profile = tempfile.TemporaryDirectory()  # kept until Sphinx ends
_startup = Path(_profile.name, "profile_default", "startup")
_startup.mkdir(parents=True)
shutil.copy(ROOT / "docs" / "generate" / "kernel.py", _startup)
os.environ["IPYTHONDIR"] = _profile.name
os.environ["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])

from docs.generate import docstrings, linking, pages  # noqa: E402 - found by the path above

import isiw  # noqa: E402

project = "isiw"
author = "The isiw developers"
project_copyright = "The isiw developers, MIT licence"
version = release = isiw.__version__

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
exclude_patterns = ["README.md", "generate/**", "**/.ipynb_checkpoints/**"]
default_role = "py:obj"

nb_execution_mode = "force"
nb_execution_timeout = 240
nb_execution_in_temp = True
nb_execution_raise_on_error = True
nb_merge_streams = True
myst_enable_extensions = ["attrs_inline", "colon_fence", "deflist", "fieldlist"]
myst_heading_anchors = 6

autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
autodoc_type_aliases = {name: name for name in ("ArrayLike", "FloatArray", "IntArray", "BoolArray")}
python_use_unqualified_type_names = True
napoleon_google_docstring = True
napoleon_use_rtype = False

html_theme = "furo"
html_title = "isiw"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_js_files = ["site.js"]
html_copy_source = False
html_show_sphinx = False
html_theme_options = {
    "navigation_with_keys": False,
    "light_css_variables": {"color-brand-primary": "#1d5a8a", "color-brand-content": "#1d5a8a"},
    "dark_css_variables": {"color-brand-primary": "#7db8e8", "color-brand-content": "#7db8e8"},
}


def setup(app: object) -> None:
    """Write the pages that are made, and connect what reads the others."""
    pages.connect(app)
    docstrings.connect(app)
    linking.connect(app)
