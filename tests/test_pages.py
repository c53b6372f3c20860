"""Every command and block of tutorial, how-to and README, page by page, in the order in which a reader meets them."""

import re

import pytest
from pages import DOCS, blocks, follow

LEARNT = [*sorted(DOCS.glob("tutorial/*.md")), *sorted(DOCS.glob("how-to/*.md"))]
QUICK = ("rx90",)
"""Pages that every run of the tests follows; the others take minutes together."""
MARKED = [(page, block) for page in LEARNT for block in blocks(page) if block.reason]


@pytest.mark.parametrize(
    "page",
    [pytest.param(page, marks=() if page.stem in QUICK else pytest.mark.slow, id=page.stem) for page in LEARNT],
)
def test_a_page_can_be_followed_to_its_end(page, tmp_path):
    follow(page, tmp_path)


@pytest.mark.parametrize(("page", "block"), MARKED, ids=lambda x: getattr(x, "stem", None) or str(x.line))
def test_a_block_that_is_not_run_says_why_in_a_few_words(page, block):
    assert re.fullmatch(r"\w+ [\w ,'./-]{8,80}", block.reason)
