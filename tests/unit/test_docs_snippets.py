"""The Python snippets of the guide run, each page from its top to its bottom."""

import re
from pathlib import Path

import pytest

GUIDE = Path(__file__).resolve().parents[2] / "docs" / "guide"
SNIPPET = re.compile(r"```python\n(.*?)```", re.DOTALL)


@pytest.mark.parametrize(
    "page",
    [
        "accuracy",
        "adding_a_wall",
        "analysis",
        "effects",
        "fields",
        "hard_cases",
        "performance",
        "walls",
    ],
)
def test_snippets_run(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SDPD_CACHE", str(tmp_path))
    if page == "walls":
        pytest.importorskip("meshio")
    if page in ("accuracy", "fields"):
        pytest.importorskip("matplotlib").use("Agg")
    snippets = SNIPPET.findall((GUIDE / f"{page}.md").read_text(encoding="utf-8"))
    assert snippets
    names: dict[str, object] = {}
    for number, snippet in enumerate(snippets):
        exec(compile(snippet, f"{page}.md, snippet {number}", "exec"), names)
    if page == "analysis":
        assert abs(names["estimate"].z(300.0)) < 4.0
        assert 0.8 < names["d"].value / names["scene"].self_diffusion < 1.3
