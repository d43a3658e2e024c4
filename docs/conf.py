"""The site that Sphinx makes of this folder: sphinx-build -W docs build/site."""

import hashlib
import sys
from pathlib import Path

TOP = Path(__file__).parents[1]
sys.path[:0] = [str(TOP / "docs"), str(TOP)]

from jupyter_cache import get_cache  # noqa: E402

import taichi_tracer  # noqa: E402

project, author, language = "taichi_tracer", "the authors of taichi_tracer", "en"
version = release = taichi_tracer.__version__
extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
    "site_formulas",
    "site_pictures",
    "site_reference",
]
exclude_patterns = ["images", "gallery", "**/.ipynb_checkpoints"]
myst_fence_as_directive = ["math"]
html_math_renderer = "mathml"
myst_heading_anchors = 4
nb_merge_streams = True  # what a loop prints is one output
# A notebook is executed again when it or the package has changed.
SOURCES = sorted((*TOP.glob("taichi_tracer/**/*.py"), *TOP.glob("scene_data_dir/**/*.obj")))
PACKAGE = hashlib.sha256(b"".join(path.read_bytes() for path in SOURCES)).hexdigest()[:16]
nb_execution_mode, nb_execution_timeout, nb_execution_raise_on_error = "cache", 300, True
nb_execution_cache_path = str(TOP / "build" / f"notebooks_{PACKAGE}")
get_cache(nb_execution_cache_path).list_cache_records()  # makes its tables before the processes that read pages start
autodoc_member_order = "bysource"
autodoc_typehints = "none"  # the docstrings say shapes and units
html_theme, html_title = "furo", "taichi_tracer"
html_theme_options = {"navigation_with_keys": True}
html_static_path, html_css_files = ["_static"], ["site.css"]
html_show_sphinx = False
html_copy_source = False
pygments_style, pygments_dark_style = "default", "native"  # all colours have a contrast of 4.5 and more
