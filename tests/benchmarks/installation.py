"""Print what an installation takes on the disk, package by package: docs/installation.md.

.venv/bin/python tests/benchmarks/installation.py                  # in a new environment
.venv/bin/python tests/benchmarks/installation.py --extras twin,fast
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from importlib.metadata import Distribution, distributions
from pathlib import Path

ROOT = Path(__file__).parents[2]


def size_of(distribution: Distribution) -> int:
    """Size of all files of a package [byte]."""
    files = (Path(str(distribution.locate_file(file))) for file in distribution.files or ())
    return sum(file.stat().st_size for file in files if file.is_file() and "__pycache__" not in file.parts)


def sizes(environment: Path) -> dict[str, int]:
    """Sizes of the packages of an environment by name, the greatest first [byte]."""
    (site,) = environment.glob("lib/python*/site-packages")
    found = {one.metadata["Name"]: size_of(one) for one in distributions(path=[str(site)])}
    return dict(sorted(found.items(), key=lambda item: -item[1]))


def installed(folder: Path, extras: str) -> Path:
    """A new environment with trajevo and what it needs, in the versions that the tests have."""
    environment = folder / "environment"
    subprocess.run([sys.executable, "-m", "venv", str(environment)], check=True)
    wanted = f"{ROOT}[{extras}]" if extras else str(ROOT)
    pip = [str(environment / "bin" / "python"), "-m", "pip", "install", "--quiet", "--no-compile"]
    subprocess.run([*pip, "-c", str(ROOT / "constraints.txt"), wanted], check=True)
    return environment


def rows(found: dict[str, int]) -> Iterator[str]:
    """Lines of the table [MB]."""
    for name, size in found.items():
        if size >= 1e6:
            yield f"{name:32} {size / 1e6:8.1f} MB"
    rest = [size for size in found.values() if size < 1e6]
    yield f"{f'{len(rest)} others':32} {sum(rest) / 1e6:8.1f} MB"
    yield f"{'all':32} {sum(found.values()) / 1e6:8.1f} MB"


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--extras", default="", help="extras with commas between them")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as made:
        print("\n".join(rows(sizes(installed(Path(made), given.extras)))))
