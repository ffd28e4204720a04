"""What the pages show of Python runs as it stands there, page by page, from first to last."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import Any

import pytest

from places import MODELS, ROOT

PAGES = sorted(
    str(page.relative_to(ROOT))
    for folder in (".", "bench", "engine", "engine/python", "models/scenes")
    for page in (ROOT / folder).glob("*.md")
    if "import linden\n" in page.read_text()
)


def blocks(page: str) -> list[str]:
    return re.findall(r"^```python\n(.*?)^```", (ROOT / page).read_text(), re.MULTILINE | re.DOTALL)


def test_there_are_pages() -> None:
    assert {"README.md", "engine/python/README.md"} <= set(PAGES)


@pytest.mark.parametrize("page", PAGES)
def test_pages_run(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copytree(MODELS, tmp_path / "models")
    monkeypatch.chdir(tmp_path)
    if "import linden.gym\n" in (ROOT / page).read_text():
        pytest.importorskip("gymnasium")
    names: dict[str, Any] = {}
    for k, block in enumerate(blocks(page)):
        exec(compile(block, f"{page}, block {k + 1}", "exec"), names)
    assert names
