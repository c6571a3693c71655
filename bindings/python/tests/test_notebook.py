"""Runs all cells of the notebook, and checks that its statements come from the data."""

import os
import re
from pathlib import Path

import nbformat
import osp
import pytest
from nbclient import NotebookClient

NOTEBOOK = Path(__file__).resolve().parents[1] / "examples" / "which_structure.ipynb"


def run(monkeypatch, file=None):
    """Runs the notebook. Returns everything that it prints."""
    if file:
        monkeypatch.setenv("OSP_NOTEBOOK_FILE", str(file))
    else:
        monkeypatch.delenv("OSP_NOTEBOOK_FILE", raising=False)
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    resources = {"metadata": {"path": str(NOTEBOOK.parent)}}
    NotebookClient(notebook, timeout=1200, kernel_name="python3", resources=resources).execute()
    outputs = [output for cell in notebook.cells if cell.cell_type == "code" for output in cell.outputs]
    assert not [output for output in outputs if output.output_type == "error"]
    return "".join(output.text for output in outputs if output.output_type == "stream" and output.name == "stdout")


def test_the_notebook_answers_for_a_shipped_recording(monkeypatch, tmp_path):
    monkeypatch.setenv("OSP_NOTEBOOK_BUDGET_SECS", "1")
    chart = Path(os.environ.get("OSP_NOTEBOOK_CHART", tmp_path / "chart.png"))
    chart.unlink(missing_ok=True)
    monkeypatch.setenv("OSP_NOTEBOOK_CHART", str(chart))
    printed = run(monkeypatch)
    verdict = re.search(
        r"portrait\.ron: take ([\w-]+)(?: \(or [\w, -]+ %\))?: ([\d.]+) µs a frame .* over (\d+) frames, .* next is ([\w-]+) with ([\d.]+) µs, "
        r"and brute-force takes ([\d.]+) µs\.",
        printed,
    )
    assert verdict, printed
    first, us, frames, second, second_us, brute_us = verdict.groups()
    assert {first, second} <= set(osp.INDEXES) and first != second
    assert 0 < float(us) <= float(second_us) <= float(brute_us) and int(frames) >= 40
    assert re.search(r"^\d+ % of the polygons in view are hidden", printed, re.MULTILINE)
    assert chart.read_bytes().startswith(b"\x89PNG")


def test_the_notebook_answers_for_a_sketch_of_one_s_own(monkeypatch, corpus):
    monkeypatch.setenv("OSP_NOTEBOOK_BUDGET_SECS", "0.2")
    monkeypatch.delenv("OSP_NOTEBOOK_CHART", raising=False)
    files = [path for path in sorted(corpus.glob("tilt/*.tilt")) if 100_000 < path.stat().st_size < 1_000_000]
    if not files:
        pytest.skip("no .tilt of 0.1 to 1 MB in the folder of real sessions")
    assert f"{files[0].name}: take " in run(monkeypatch, files[0])


def test_the_notebook_is_committed_without_outputs():
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    assert not any(cell.outputs or cell.execution_count for cell in notebook.cells if cell.cell_type == "code")
