"""Site of the documentation: `python -m sphinx -W --keep-going docs docs/_build/html`.

Needs the extra `docs` and no network. The pages are Markdown that also reads well on GitHub; the
gallery is run while the site is built.
"""

import logging
import os
import sys
from importlib.util import find_spec
from pathlib import Path

from sphinx_gallery.sorting import ExplicitOrder

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE / "_ext"), str(HERE.parent)]
os.environ.setdefault("MPLBACKEND", "Agg")

import jointlaw  # noqa: E402
from jointlaw.support.pyplot import STYLE, pyplot  # noqa: E402

# One script within the site that draws letters as outlines: formulas need neither network nor fonts
MATHJAX = Path(find_spec("sphinx-mathjax-offline").origin).parent / "static/mathjax/tex-svg-full.js"

project = "jointlaw"
author = "The jointlaw developers"
project_copyright = author
version = release = jointlaw.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx_gallery.gen_gallery",
    "sphinx.ext.mathjax",
    "sphinx_copybutton",
    "blocks_view",
    "browser",
    "claims",
    "commands",
    "docstrings",
    "hosts",
    "pages",
]
exclude_patterns = ["_build", "gallery", "paper", "_ext"]
suppress_warnings = [
    "config.cache",  # the settings of the gallery hold objects
]
nitpicky = True  # a reference that leads nowhere is an error
nitpick_ignore_regex = [(r"py:.*", r".*")]  # types of numpy and Python live on other sites

myst_enable_extensions = ["dollarmath", "amsmath", "html_image"]
myst_heading_anchors = 3

myst_html_meta = {
    "description": "jointlaw: a constitutive law for rough rock joints in discrete-element, block "
    "and finite-element codes",
}
copybutton_prompt_text = r">>> |\.\.\. |\$ "
copybutton_prompt_is_regexp = True

html_theme = "furo"
html_favicon = "_static/favicon.svg"
html_title = f"jointlaw {release}"
html_static_path = ["_static", str(MATHJAX)]
html_css_files = ["site.css"]
html_js_files = ["pause.js"]
html_theme_options = {  # the palette of site.css, of the joint in the browser and of docs/draw
    "light_css_variables": {"color-brand-primary": "#1f6fd0", "color-brand-content": "#1f6fd0"},
    "dark_css_variables": {"color-brand-primary": "#5aa2f5", "color-brand-content": "#5aa2f5"},
}
mathjax_path = MATHJAX.name
html_show_sourcelink = False
html_copy_source = False

default_role = "code"  # single backticks in docstrings
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_type_aliases = {name: name for name in ("Array", "ArrayLike", "Index", "Out")}
python_use_unqualified_type_names = True

logging.getLogger("skfem").setLevel(logging.WARNING)  # it logs every assembly step

ORDER = (
    "first_curve", "closure_cycle", "direct_shear", "strength_envelope",
    "bond", "damping", "mating", "from_scan", "table",
    "batch", "blocks", "newton", "finite_elements", "snapshot",
)  # fmt: skip


def set_style(settings, name):
    """Give an example the style of all pictures, after the gallery has reset matplotlib."""
    pyplot().rcParams.update(STYLE)


FIGURES = sorted(path.name for path in HERE.glob("paper/plot_*.py"))
sphinx_gallery_conf = {
    "examples_dirs": ["gallery", "paper"],
    "gallery_dirs": ["examples", "figures"],
    "ignore_pattern": "^_",  # modules that several scripts import
    "within_subsection_order": ExplicitOrder([f"plot_{name}.py" for name in ORDER] + FIGURES),
    "reset_modules": ("matplotlib", set_style),
    "remove_config_comments": True,
    "capture_repr": (),  # show printed output, not the value of the last expression
    "download_all_examples": False,
    "show_memory": False,
    "thumbnail_size": (640, 448),  # pixels: twice the displayed size
    "write_computation_times": False,
    "min_reported_time": 5,
    "show_signature": False,
    "abort_on_example_error": True,
}
