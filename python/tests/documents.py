"""Every snippet of docs/python.md runs, in the order of the page, and every example of a docstring."""

import doctest
import importlib
import os
import re
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
MODULES = ("_poses", "_robots", "_moves", "_programs", "_smoothing", "otg", "timing")


class Documents(unittest.TestCase):
    def test_snippets(self):
        text = (ROOT / "docs/python.md").read_text(encoding="utf-8")
        snippets = re.findall(r"^```python\n(.*?)^```$", text, re.S | re.M)
        self.assertGreater(len(snippets), 8)
        here = os.getcwd()
        with tempfile.TemporaryDirectory() as folder:
            os.symlink(ROOT / "examples", Path(folder) / "examples")
            os.chdir(folder)
            try:
                names = {"__name__": "docs"}
                for number, snippet in enumerate(snippets, 1):
                    code = compile(snippet, f"docs/python.md, snippet {number}", "exec")
                    exec(code, names)
            finally:
                os.chdir(here)

    def test_docstrings(self):
        for name in MODULES:
            module = importlib.import_module(f"canter.{name}")
            failed, tried = doctest.testmod(module)
            self.assertEqual(failed, 0, name)
        self.assertGreater(tried, 0)


if __name__ == "__main__":
    unittest.main()
