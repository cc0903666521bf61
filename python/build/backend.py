"""Builds the wheel: first the command `canter`, which goes into the wheel as a script, then maturin.

    pip install ./python                 # from a clone; needs Rust, a C and a C++ compiler
    pip wheel --no-deps ./python         # makes the wheel only

`maturin build` alone makes a wheel too, with the command of the last run of this file:
`python3 python/build/backend.py`.
"""

import os
import shutil
import subprocess
from pathlib import Path

HERE = Path(__file__).resolve().parent.parent
SCRIPTS = HERE / "data" / "scripts"


def put_command():
    """Builds the command and puts it where maturin looks for scripts."""
    root = HERE.parent
    if not (root / "cli" / "Cargo.toml").is_file():
        raise SystemExit(
            "the command canter is built from the whole repository: use a clone, or the wheel"
        )
    words = ["cargo", "build", "--release", "--locked", "--bin", "canter", "--package", "cli"]
    try:
        subprocess.run(words, cwd=root, check=True)
    except FileNotFoundError:
        raise SystemExit(
            "cargo is missing: install Rust (https://rustup.rs), or the wheel, which needs none"
        ) from None
    target = Path(os.environ.get("CARGO_TARGET_DIR", root / "target"))
    SCRIPTS.mkdir(parents=True, exist_ok=True)
    shutil.copy(root / target / "release" / "canter", SCRIPTS / "canter")
    subprocess.run(["strip", str(SCRIPTS / "canter")], check=False)


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    import maturin

    put_command()
    return maturin.build_wheel(wheel_directory, config_settings, metadata_directory)


def build_editable(wheel_directory, config_settings=None, metadata_directory=None):
    import maturin

    put_command()
    return maturin.build_editable(wheel_directory, config_settings, metadata_directory)


def build_sdist(sdist_directory, config_settings=None):
    raise SystemExit("there is no source distribution: build from a clone, or use the wheel")


def get_requires_for_build_wheel(config_settings=None):
    return []


def get_requires_for_build_editable(config_settings=None):
    return []


def prepare_metadata_for_build_wheel(metadata_directory, config_settings=None):
    import maturin

    SCRIPTS.mkdir(parents=True, exist_ok=True)
    return maturin.prepare_metadata_for_build_wheel(metadata_directory, config_settings)


prepare_metadata_for_build_editable = prepare_metadata_for_build_wheel


if __name__ == "__main__":
    put_command()
    print(SCRIPTS / "canter")
