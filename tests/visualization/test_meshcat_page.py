import re

from drake_aerial.visualization.colored_mesh import ColoredMesh
from drake_aerial.visualization.colors import RED
from drake_aerial.visualization.file_view import View
from drake_aerial.visualization.meshcat_page import add_overlay, card


def test_the_card_escapes_names():
    text = card("<script>alert(1)</script>", [(RED, "a & b")], "x < y")
    assert "<script>alert" not in text
    assert "a &amp; b" in text
    assert "x &lt; y" in text


def test_the_overlay_goes_before_the_end_of_the_body():
    page = add_overlay("<html><head></head><body><p>1</p></body></html>", "<b>card</b>", "title")
    assert page.endswith("<b>card</b></body></html>")
    assert 'name="viewport"' in page


def test_a_page_is_self_contained(tmp_path):
    mesh = ColoredMesh()
    mesh.add_points([[0, 0, 0], [0.1, 0, 0]], radius=0.01)
    View(mesh, "two points", [(RED, "cloud")], "").write(tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text()
    assert "two points" in page
    assert 'src="http' not in page
    # One link to a help page is Meshcat's own; nothing is loaded from elsewhere.
    assert not re.findall(r"<link[^>]+http|@import|url\(http", page)
