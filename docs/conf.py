"""The site: what Sphinx needs to know. Everything that it builds from code and files is in `_ext`."""

import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE / "_ext"), str(HERE.parent)]

import trajevo  # noqa: E402, from this checkout

project = "trajevo"
author = "The trajevo developers"
copyright = author
version = release = trajevo.__version__
html_title = f"trajevo {release}"

#: Packages whose types are told without a link, since nothing is looked up in the network.
OTHERS = (
    "abc",
    "collections",
    "matplotlib",
    "np",
    "numpy",
    "pathlib",
    "pd",
    "pydantic",
    "pymoo",
    "xarray",
    "xml",
    "xr",
)

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "myst_nb",
    "sphinx_copybutton",
    "sphinx_design",
    "sphinx_gallery.gen_gallery",
    "site_pages",
]

exclude_patterns = ["_ext", "gallery", "papers/reproduced", "auto_gallery/**.ipynb", "auto_gallery/**.py"]
nitpicky = True
nitpick_ignore_regex = [("py:.*", rf"({'|'.join(OTHERS)})\..*"), ("py:class", ".*=.*")]

html_theme = "furo"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_sourcelink = False
html_copy_source = False
# Pages load nothing from the network.
html_theme_options = {"navigation_with_keys": True}
nb_ipywidgets_js = {}
copybutton_exclude = ".linenos, .gp, .go"

myst_enable_extensions = ["attrs_block", "colon_fence", "deflist"]
myst_heading_anchors = 4

# Notebooks come executed: in this process, which has imported all modules, no kernel answers.
nb_execution_mode = "off"
nb_merge_streams = True

autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented_params"
autodoc_typehints_format = "short"
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 80
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False

sphinx_gallery_conf = {
    "examples_dirs": "gallery",
    "gallery_dirs": "auto_gallery",
    "filename_pattern": "/plot_",
    "capture_repr": (),
    "download_all_examples": False,
    "show_memory": False,
    "show_signature": False,
    "write_computation_times": False,
    "plot_gallery": True,
    "abort_on_example_error": True,
    "min_reported_time": 60,
}
