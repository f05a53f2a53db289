"""Cards in a real browser, beside the rules that notebooks have for tables."""

import pytest

from realitygap.drawing import Card, Table

JUPYTERLAB = """
.jp-RenderedHTMLCommon table { font-size: 8px; }
.jp-RenderedHTMLCommon td, .jp-RenderedHTMLCommon th { text-align: right; }
.jp-RenderedHTMLCommon tbody tr:nth-child(odd) { background: rgb(250, 0, 0); }
.jp-RenderedHTMLCommon tbody tr:nth-child(even) { background: rgb(250, 0, 0); }
.jp-RenderedHTMLCommon pre { background: rgb(250, 0, 0); color: rgb(250, 0, 0); }
"""
"""Rules of JupyterLab 4, in louder colors."""

THEMES = {
    "light": ("light", 'data-jp-theme-light="true"', False),
    "dark JupyterLab": ("light", 'data-jp-theme-light="false"', True),
    "light JupyterLab in a dark system": ("dark", 'data-jp-theme-light="true"', False),
    "dark system": ("dark", "", True),
    "VS Code": ("light", 'class="vscode-dark"', True),
    "light page in a dark system": ("dark", 'data-theme="light"', False),
}


@pytest.mark.slow
@pytest.mark.parametrize(("system", "body", "is_dark"), THEMES.values(), ids=THEMES)
def test_a_card_follows_the_theme_and_can_be_read_in_a_notebook(visitors, system, body, is_dark):
    card = Card("title", ["SIM"], "lead", "warning", [Table(["a", "b"], [["1", "2"], ["3", "4"]])], ["code"])
    page = visitors.browser.new_page(color_scheme=system)
    page.set_content(
        f"<style>{JUPYTERLAB}</style><body {body}><div class='jp-RenderedHTMLCommon'>{card.to_html()}</div></body>"
    )
    style = "([what, key]) => getComputedStyle(document.querySelector(what))[key]"

    def of(what, key):
        return page.evaluate(style, [f".rg-card {what}".strip(), key])

    assert of("", "backgroundColor") == ("rgb(28, 32, 38)" if is_dark else "rgb(255, 255, 255)")
    ink = "rgb(230, 232, 235)" if is_dark else "rgb(28, 31, 36)"
    assert [of(what, "color") for what in ("td", "pre", "p:nth-of-type(3)", "tbody th")] == [ink] * 4
    assert [of(what, "textAlign") for what in ("td", "th")] == ["left", "left"]
    assert [of(what, "backgroundColor") for what in ("tr", "tbody tr", "tbody tr + tr")] == [
        "rgba(0, 0, 0, 0)"
    ] * 3
    assert of("pre", "backgroundColor") == ("rgb(20, 23, 27)" if is_dark else "rgb(246, 247, 249)")
    page.close()
