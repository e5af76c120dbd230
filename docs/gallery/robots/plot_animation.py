"""
A robot in real time
====================

A PUMA 560 at the knee of a front, as a film of six frames a second; `animate` also writes pages that turn in space.
"""

from base64 import b64encode
from pathlib import Path
from tempfile import TemporaryDirectory

from trajevo import animate, optimise
from trajevo.problems import PickAndPlace


class Film:
    """Shows a film where the result of a cell is shown."""

    def __init__(self, file):
        self.content = b64encode(Path(file).read_bytes()).decode()

    def _repr_html_(self):
        return f'<img alt="PUMA 560" src="data:image/gif;base64,{self.content}">'


best = optimise(PickAndPlace(payload=2.5), seed=1, generations=40, population=40).knee()
with TemporaryDirectory() as folder:
    film = Film(animate(best, Path(folder) / "puma.gif", rate=6.0))
film
