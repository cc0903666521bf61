"""The notebooks of python/examples run from the first cell to the last."""

import json
import os
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
NOTEBOOKS = sorted((ROOT / "python/examples").glob("*.ipynb"))


class Notebooks(unittest.TestCase):
    def test_there_are_five(self):
        self.assertEqual(len(NOTEBOOKS), 5)

    def test_all_cells_run(self):
        here = os.getcwd()
        for path in NOTEBOOKS:
            with self.subTest(path.name), tempfile.TemporaryDirectory() as folder:
                os.symlink(ROOT / "examples", Path(folder) / "examples")
                os.chdir(folder)
                try:
                    run(path)
                finally:
                    os.chdir(here)


def run(path):
    names = {"__name__": "__main__"}
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    for number, cell in enumerate(cells, 1):
        if cell["cell_type"] == "code":
            code = compile("".join(cell["source"]), f"{path.name}, cell {number}", "exec")
            exec(code, names)


if __name__ == "__main__":
    unittest.main()
