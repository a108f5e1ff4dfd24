"""Before NumPy is loaded: one thread a process, since the tests run one process a core."""

import os
import shutil

import pytest

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")

pytest_plugins = ["drake_aerial.testing"]

# Software rendering, so that a machine without a graphics card will do.
BROWSER_FLAGS = [
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
]


@pytest.fixture(scope="module")
def browser():
    """Chromium without a window, for tests with the marker `browser`."""
    from playwright.sync_api import sync_playwright

    installed = next(
        filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
    )
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=installed, args=BROWSER_FLAGS)
        yield browser
        browser.close()


@pytest.fixture(params=[(1280, 800), (390, 780)], ids=["desktop", "phone"])
def opened(request, browser):
    """Open a file as a page; what it complained of, or loaded from elsewhere, fails the test."""
    page = browser.new_page(viewport={"width": request.param[0], "height": request.param[1]})
    complaints, requests = [], []
    page.on(
        "console",
        lambda message: (
            complaints.append(message) if message.type in ("error", "warning") else None
        ),
    )
    page.on("pageerror", lambda error: complaints.append(error))
    page.on("request", lambda request: requests.append(request.url))

    def open_file(path):
        page.goto(path.resolve().as_uri())
        return page

    yield open_file
    page.close()
    texts = [getattr(complaint, "text", str(complaint)) for complaint in complaints]
    # The software renderer's remarks on its own speed are not ours.
    assert [
        text for text in texts if "GPU stall" not in text and "swiftshader" not in text.lower()
    ] == []
    assert requests
    assert [url[:80] for url in requests if url.split(":")[0] not in ("file", "data", "blob")] == []
