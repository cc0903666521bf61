"""Types: the package is strict, and the stubs of the extension module are those of the module."""

import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import canter

PACKAGE = Path(__file__).resolve().parents[1] / "canter"


def run(*words):
    with tempfile.TemporaryDirectory() as folder:
        words = [sys.executable, "-m", *words]
        ran = subprocess.run(words, capture_output=True, text=True, cwd=folder, check=False)
    return ran.returncode, ran.stdout + ran.stderr


class Types(unittest.TestCase):
    def test_the_package_is_strict(self):
        files = [str(path) for path in sorted(PACKAGE.glob("*.py"))]
        code, said = run("mypy", "--strict", *files)
        self.assertEqual(code, 0, said)

    def test_the_stubs_are_those_of_the_module(self):
        code, said = run("mypy.stubtest", "canter._canter", "--ignore-disjoint-bases")
        self.assertEqual(code, 0, said)

    def test_every_public_name_is_there_and_described(self):
        for name in canter.__all__:
            self.assertTrue(getattr(canter, name).__doc__, name)


if __name__ == "__main__":
    unittest.main()
