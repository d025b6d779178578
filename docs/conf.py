"""Settings of the documentation site; ``make docs`` builds it, without the network."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "extensions"))

from graspatlas.version import __version__

project = "graspatlas"
author = "The graspatlas authors"
project_copyright = author
version = release = __version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
    "repository_links",
    "package_docstrings",
    "native_math",
    "explorer_pages",
]
exclude_patterns = ["_static", "extensions", "images"]

myst_enable_extensions = ["dollarmath", "colon_fence", "deflist"]
myst_heading_anchors = 4

html_theme = "furo"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_title = f"graspatlas {version}"
html_copy_source = False
html_show_sourcelink = False
copybutton_prompt_text = "$ "
html_math_renderer = "native"

# Reference: everything public, in the order of the source; a class's fields stand in its docstring's Attributes.
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_preserve_defaults = True
ALIASES = """AnyArray Array ArrayLike BoolArray Float32Array IndexArray Int32Array IntArray Quality RequirementLike
PlainTable Shown"""
autodoc_type_aliases = {name: name for name in ALIASES.split()}
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 88
toc_object_entries_show_parents = "hide"

# Every name must lead somewhere. The exceptions: other packages, whose manuals are not fetched, and internals that a
# docstring mentions.
nitpicky = True
nitpick_ignore_regex = [
    (
        "py:.*",
        r"(numpy|scipy|pandas|matplotlib|meshcat|pinocchio|pin|trimesh|PIL|enum|os|pathlib|collections|typing\w*)(\..*)?",
    ),
    ("py:mod", r"graspatlas\..*"),
    ("py:class", r"pybind11_builtins\..*|graspatlas\._core\.PythonSystem"),
    (
        "py:class",
        r"(PlainTable|Vector3|Interval|End|Scale|DataFrame|AnyMesh|Scene|Rotation|(tuple|dict)\[str|tuple|dict)",
    ),
    ("py:class", r"graspatlas\.(support|atlas\.grid|patches\.(turned|spline|round|base)|viewer\.figures\.style)\..*"),
    ("py:class", r"graspatlas\.(proposals\.assignments\.matching\.Counts|problem\.object_joint\.ObjectJoint)"),
    ("py:class", r"graspatlas\.(result\.exports\.Selection|quality\.batched\.F|optimizer\.rungs\.RungSummary)"),
    ("py:class", r"graspatlas\.(hand\.mechanism\.Mimic|atlas\.verification\.Check)"),
    ("py:func", r"graspatlas\.(analysis\.pareto\.knee|result\.(verification\.check_result|exports\.select))"),
    ("py:class", r"(Any|Int|Bool|Index|Int32|Float32)?Array(Like)?"),
]
