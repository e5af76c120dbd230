"""Execute every notebook into build/notebooks, in that folder: `make notebooks` (full size when TRAJEVO_FULL=1).

With arguments SOURCE TARGET one of them, as the site shows it.
"""

import sys
from pathlib import Path

import jupytext
import nbformat
from nbclient import NotebookClient

ROOT = Path(__file__).parents[1]


def execute(source: Path, target: Path) -> None:
    """Run a notebook in the folder of its copy with outputs, which is all that it may write to."""
    notebook = jupytext.read(source)
    target.parent.mkdir(parents=True, exist_ok=True)
    NotebookClient(notebook, timeout=600, resources={"metadata": {"path": str(target.parent)}}).execute()
    nbformat.write(notebook, target)


if __name__ == "__main__" and sys.argv[1:]:
    execute(Path(sys.argv[1]), Path(sys.argv[2]))
elif __name__ == "__main__":
    for file in sorted(ROOT.glob("notebooks/[0-9]*.py")):
        output = ROOT / "build" / "notebooks" / f"{file.stem}.ipynb"
        execute(file, output)
        print(f"written: {output.relative_to(ROOT)}")
