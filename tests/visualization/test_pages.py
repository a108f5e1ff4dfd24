import re

from drake_aerial.visualization.pages import add_card, card, write_picture_page
from drake_aerial.visualization.picture import RED, Picture


def test_the_card_escapes_names():
    text = card("<script>alert(1)</script>", [(RED, "a & b")], "x < y")
    assert "<script>alert" not in text
    assert "a &amp; b" in text
    assert "x &lt; y" in text


def test_the_card_goes_before_the_end_of_the_body():
    page = add_card("<html><head></head><body><p>1</p></body></html>", "<b>card</b>", "title")
    assert page.endswith("<b>card</b></body></html>")
    assert 'name="viewport"' in page


def test_a_page_is_self_contained(tmp_path):
    picture = Picture()
    picture.add_points([[0, 0, 0], [0.1, 0, 0]], radius=0.01)
    write_picture_page(tmp_path / "page.html", picture, title="two points", legend=[(RED, "cloud")])
    page = (tmp_path / "page.html").read_text()
    assert "two points" in page
    assert 'src="http' not in page
    # One link to a help page is Meshcat's own; nothing is loaded from elsewhere.
    assert not re.findall(r"<link[^>]+http|@import|url\(http", page)
