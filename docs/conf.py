"""Build the documentation (tools/docs) into site/, which opens from disk without a network."""

import sys
from pathlib import Path

ROOT = Path(__file__).parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "tools"), str(ROOT / "tools" / "site")]

import docs_pictures  # noqa: E402

import drake_aerial  # noqa: E402

# Drawn by the package as it stands; kept until package, models or script change.
docs_pictures.draw(ROOT / "docs" / "pictures")

project = "drake_aerial"
author = "The drake_aerial developers"
version = release = drake_aerial.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
    "docstrings",
    "mathml",
]
source_suffix = {".md": "markdown"}
default_role = "code"
# Names such as `mass` are attributes of several classes.
suppress_warnings = ["ref.python"]

myst_enable_extensions = ["dollarmath", "deflist", "colon_fence", "attrs_inline"]
myst_heading_anchors = 3

html_theme = "furo"
html_title = f"drake_aerial {release}"
html_static_path = ["static"]
html_css_files = ["extra.css"]
html_math_renderer = "mathml"
html_show_copyright = False
html_copy_source = False
html_show_sourcelink = False
html_show_search_summary = False
# A copied command line comes without its prompt.
copybutton_prompt_text = "$ "

autodoc_member_order = "bysource"
autodoc_typehints = "none"
autodoc_class_signature = "mixed"
autodoc_preserve_defaults = True
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_use_ivar = True
toc_object_entries_show_parents = "hide"
python_maximum_signature_line_length = 88
