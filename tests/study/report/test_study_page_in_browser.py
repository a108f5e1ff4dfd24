"""The study's report in a real browser, on a desk and on a phone."""

import shutil

import pytest

from drake_aerial.study.report.study_report import write_report

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def report(undisturbed, tmp_path_factory):
    folder = tmp_path_factory.mktemp("reported") / "study"
    shutil.copytree(undisturbed, folder)
    return write_report(folder).page


def test_the_report_reads_on_any_screen(opened, report):
    page = opened(report)
    assert "8 flights" in page.locator(".answer").first.inner_text()
    assert page.locator("h2").all_inner_texts()[:3] == [
        "What was tested",
        "At a glance: distance of the payload from its path",
        "The paper's claims",
    ]
    # Wide tables scroll in themselves; the page does not.
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    images = page.locator("figure img")
    assert images.count() >= 4
    for index in range(images.count()):
        assert images.nth(index).evaluate("image => image.complete && image.naturalWidth > 200")


def test_a_claim_opens_where_it_is_linked(opened, report):
    page = opened(report)
    claim = page.locator("#claim-1")
    assert not claim.get_by_text("Rule:").is_visible()
    claim.locator("summary").click()
    assert claim.get_by_text("Rule:").is_visible()
    page.get_by_role("link", name="2", exact=True).click()
    page.wait_for_function("location.hash === '#claim-2'")
    assert page.locator("#claim-2").get_by_text("Rule:").is_visible()
    assert page.evaluate(
        "document.querySelector('#claim-2').getBoundingClientRect().top < innerHeight"
    )
