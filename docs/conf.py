"""How Sphinx builds these pages: `sphinx-build -W docs docs/_build`. Nothing is fetched from a network."""

import re
import sys
from importlib import resources
from pathlib import Path

from docutils import nodes

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

import api_pages  # noqa: E402
import make_billion  # noqa: E402
import make_faults  # noqa: E402
import make_gallery  # noqa: E402
import make_lab  # noqa: E402
import make_real_data  # noqa: E402
import make_recovery  # noqa: E402
import make_sensors  # noqa: E402
import make_speed  # noqa: E402
import reference_pages  # noqa: E402

from realitygap import __version__  # noqa: E402


def token_colors() -> dict[str, dict[str, str]]:
    """Return the colors that all pages share, by theme and name."""
    sheet = resources.files("realitygap.drawing").joinpath("tokens.css").read_text("utf-8")
    light, _, dark = sheet.partition("@media")
    return {
        theme: dict(re.findall(r"--([\w-]+): (#\w+);", part))
        for theme, part in (("light", light), ("dark", dark))
    }


project = "realitygap"
author = "the realitygap authors"
copyright = author
version = release = __version__

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx_design"]
myst_enable_extensions = ["colon_fence", "deflist"]
myst_heading_anchors = 3
exclude_patterns = ["_build", "generated/parts", "jupyter_execute"]
nb_execution_mode = "force"
nb_execution_in_temp = True
nb_execution_timeout = 300  # of a cell [s]: kernels may have to be compiled
nb_execution_raise_on_error = True
nb_ipywidgets_js = {}  # which would be fetched from a network
nb_mime_priority_overrides = [("html", "application/vnd.jupyter.widget-view+json", None)]
root_doc = "index"
html_theme = "furo"
html_theme_options = {
    f"{theme}_css_variables": {
        "color-brand-primary": colors["accent"],
        "color-brand-content": colors["accent"],
        "color-foreground-primary": colors["text"],
        "color-foreground-secondary": colors["muted"],
        "color-foreground-muted": colors["muted"],
        "color-background-primary": colors["card"],
        "color-background-secondary": colors["ground"],
        "color-background-border": colors["rule"],
    }
    for theme, colors in token_colors().items()
}
html_static_path = ["static"]
html_css_files = ["pages.css"]
html_title = f"realitygap {__version__}"
html_show_sphinx = False
html_copy_source = False

default_role = "code"
nitpicky = True
nitpick_ignore_regex = [
    # other people's packages, and short names inside our own signatures
    (
        r"py:.*",
        r"(numpy|np|polars|pl|pydantic|pathlib|collections|typing|annotated_types|NDArray|ArrayLike)\b.*",
    ),
    (
        r"py:.*",
        r"(Any|Callable|Figure|Panel|Iterator|Iterable|Literal|Mapping|ResetNeeded|Sequence|Path|Self|optional|ConfigDict|BaseModel)",
    ),
    (
        r"py:(class|obj)",
        r"(float64|int32|uint8|bool|columns|median_low|left|bottom|right|top|_?[A-Z]|n|t|s|ge|le|gt|lt|\d.*|.*=.*)",
    ),
    (r"py:.*", r"realitygap\..*\._.*"),
    (r"py:.*", r"realitygap\.kernels.*"),
]
toc_object_entries = False
autodoc_default_options = {"members": True, "member-order": "bysource"}
autodoc_typehints = "none"
autodoc_preserve_defaults = True
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False
napoleon_custom_sections = [("Source", "notes_style"), ("Differs", "notes_style")]

UNIT = re.compile(r"(?<=\d) (?=(?:%|m|mm|cm|s|ms|min|h|V|Hz|kB|MB|GB|GFlop|GFlop/s|rad)(?![\w/]))")
"""The space between a number and its unit."""

SECTION = re.compile(r"(Args|Returns|Raises|Attributes|Yields|Example|Examples|Note):$")


def as_restructured(app, what, name, obj, options, lines):
    """Our docstrings' code by indentation as reStructuredText's literal blocks; their tables as they are."""
    out, previous, in_code, in_table = [], "", False, False
    if what == "property":  # napoleon would take what stands before a colon for a type
        lines[:] = [line if line.startswith(" ") else line.replace(": ", " – ") for line in lines]
    for line in lines:
        text = line.strip()
        indented = line.startswith("    ") and not in_section(out)
        if text.startswith("|") and not in_table:
            out += ["::", ""]
            in_table = True
        if in_table and not text.startswith("|"):
            in_table = False
        if indented and not previous and not in_code:
            out += ["::", ""]
            in_code = True
        if text and not line.startswith("    "):
            in_code = False
        out.append("    " + line if in_table else line)
        previous = text
    lines[:] = out


def skip_pydantic(app, what, name, obj, skip, options):
    """Leave out what pydantic adds to a model."""
    return True if what == "class" and name.startswith("model_") else None


def in_section(lines):
    """Whether the last line that is not indented opens a section such as `Args:`."""
    for line in reversed(lines):
        if line and not line.startswith(" "):
            return bool(SECTION.match(line)) or line.startswith(("Source:", "Differs:"))
    return False


def keep_units(app, doctree):
    """Have no line end between a number and its unit."""
    for text in list(doctree.findall(nodes.Text)):
        if not isinstance(text.parent, nodes.literal | nodes.literal_block | nodes.raw) and UNIT.search(text):
            text.parent.replace(text, nodes.Text(UNIT.sub("\N{NO-BREAK SPACE}", text)))


def make_accessible(app, page, template, context, doctree):
    """Let the keyboard scroll code and tables, give headings their level, and show the contents on narrow screens."""
    if "body" in context:
        body = context["body"].replace("<pre>", '<pre tabindex="0">')
        context["body"] = body.replace('<div class="table-wrapper', '<div tabindex="0" class="table-wrapper')
        if context.get("display_toc") and "hide-toc" not in (context.get("meta") or {}):
            here = '<details class="here"><summary>On this page</summary>' + context["toc"] + "</details>"
            context["body"] = context["body"].replace("</h1>", "</h1>" + here, 1)
    tree = context.get("furo_navigation_tree", "")
    context["furo_navigation_tree"] = tree.replace('role="heading"', 'role="heading" aria-level="2"')


def setup(app):
    """Write the generated pages before Sphinx looks for pages."""
    more = {
        "parts/billion.md": make_billion.page_tables(),
        "parts/gallery.md": make_gallery.page_part(),
        **api_pages.page_parts(),
        **make_speed.page_parts(),
        **make_faults.page_parts(),
        **make_lab.page_parts(),
        **make_sensors.page_parts(),
        **make_real_data.page_parts(),
        **make_recovery.page_parts(),
    }
    reference_pages.write_all(HERE / "generated", more)
    app.connect("autodoc-skip-member", skip_pydantic)
    app.connect("autodoc-process-docstring", as_restructured, priority=1)
    app.connect("doctree-read", keep_units)
    app.connect("html-page-context", make_accessible, priority=900)  # after the theme has made its navigation
