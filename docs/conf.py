"""Settings of the site: `make docs`."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

DOCS = Path(__file__).parent
sys.path[:0] = [str(DOCS), str(DOCS.parent / "src")]

import site_pages  # noqa: E402

import xcrack  # noqa: E402

project = "xcrack"
author = "The xcrack developers"
copyright = "the xcrack developers"
release = version = xcrack.__version__
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.mathjax",
    "numpydoc",
]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
root_doc = "index"
exclude_patterns = ["_build", "README.md"]
myst_enable_extensions = ["colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 4
autosummary_generate = False
autodoc_typehints = "none"
numpydoc_show_class_members = False
numpydoc_xref_param_type = False
nitpicky = False
html_theme = (
    "pydata_sphinx_theme" if importlib.util.find_spec("pydata_sphinx_theme") else "alabaster"
)
html_title = f"xcrack {version}"
html_theme_options = (
    {
        "show_toc_level": 2,
        "navigation_with_keys": False,
        "show_nav_level": 1,
        "header_links_before_dropdown": 6,
        "pygments_light_style": "default",
        "pygments_dark_style": "github-dark",
    }
    if html_theme != "alabaster"
    else {}
)
html_show_sourcelink = False
templates_path: list[str] = []
html_static_path = ["static"]
html_css_files = ["site.css"]
html_favicon = "static/icon.svg"
html_context = {"default_mode": "auto"}

site_pages.write(DOCS)
