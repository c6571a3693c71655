"""Runs the examples in the documentation, and checks that every public name is documented."""

import doctest
import inspect
import re
from pathlib import Path

import numpy as np
import osp
import pytest

HERE = Path(__file__).resolve().parents[1]


def documented():
    """Yields every public name of the package with its docstring."""
    yield "osp", osp.__doc__
    for name in osp.__all__:
        thing = getattr(osp, name)
        if not callable(thing):
            continue
        yield name, thing.__doc__
        if inspect.isclass(thing):
            for member, value in vars(thing).items():
                if not member.startswith("_") and (callable(value) or hasattr(value, "__get__")):
                    yield f"{name}.{member}", inspect.getdoc(getattr(thing, member))


ALL = dict(documented())


def is_of_pictures(text):
    return re.search(r"^ *>>> .*osp\.render\(", text, flags=re.MULTILINE) is not None


# The README's examples with pictures are separate, so that the other examples run without an adapter, too.
BLOCKS = re.findall(r"^```python\n.*?^```", (HERE / "README.md").read_text(), flags=re.MULTILINE | re.DOTALL)
EXAMPLES = {
    **ALL,
    "README.md": "\n".join(block for block in BLOCKS if not is_of_pictures(block)),
    "README.md, pictures": "\n".join(filter(is_of_pictures, BLOCKS)),
}


@pytest.mark.parametrize("name", ALL)
def test_everything_public_is_described(name):
    assert ALL[name] and len(ALL[name]) > 15


@pytest.mark.parametrize("name", [name for name, text in EXAMPLES.items() if ">>>" in (text or "")])
def test_examples_are_true(name, recordings, monkeypatch, no_picture):
    if no_picture and is_of_pictures(EXAMPLES[name]):
        pytest.skip(no_picture)
    monkeypatch.chdir(HERE.parents[1])
    # A fence of Markdown ends the expected output.
    text = re.sub(r"^```.*$", "", inspect.cleandoc(EXAMPLES[name]), flags=re.MULTILINE)
    names = {"osp": osp, "np": np, "recordings": recordings}
    test = doctest.DocTestParser().get_doctest(text, names, name, name, 0)
    told = []
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)
    runner.run(test, out=told.append)
    assert runner.summarize(verbose=False).failed == 0, "".join(told)


def test_there_are_examples():
    assert sum(">>>" in (text or "") for text in EXAMPLES.values()) >= 10
    assert osp.__version__ == "0.1.0"
