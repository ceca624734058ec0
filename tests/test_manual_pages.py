"""The documentation as pages for a browser: nothing of the text is lost, and links lead somewhere."""

from __future__ import annotations

import html
import importlib.util
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    """All pages, as they go into the zip."""
    spec = importlib.util.spec_from_file_location("manual_pages", ROOT / "scripts" / "manual_pages.py")
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    out = tmp_path_factory.mktemp("pages") / "docs"
    made.write_pages(ROOT / "docs", out)
    return out


def test_every_word_is_there(pages):
    """Marks and addresses left out, a page says what its document says."""
    for path in (ROOT / "docs").glob("*.md"):
        source = re.sub(r"\]\([^)]*\)", "]", path.read_text(encoding="utf-8"))
        source = re.sub(r"!\[[^\]]*\]", "", source)
        source = re.sub(r"^```\w+$", "", source, flags=re.MULTILINE)  # the language of code
        shown = (pages / f"{path.stem}.html").read_text(encoding="utf-8").partition("</nav>")[2]
        told = html.unescape(re.sub(r"<[^>]+>", " ", shown))
        left = set(re.findall(r"[^\W_]{4,}", source)) - set(re.findall(r"[^\W_]{4,}", told))
        assert not left, (path.name, left)


def test_links_between_pages_and_pictures_lead_somewhere(pages):
    count = 0
    for path in pages.glob("*.html"):
        for link in re.findall(r'(?:href|src)="([^"#:]+)', path.read_text(encoding="utf-8")):
            if link.startswith("../") or link.startswith("benchmark/"):
                continue  # of the sources, which the zip leaves out
            assert (pages / link).is_file(), (path.name, link)
            count += 1
    assert count > 50
