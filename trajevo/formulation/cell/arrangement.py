"""What an arrangement of a cell is: columns of decision vectors -> where the points of every individual lie."""

from __future__ import annotations

from abc import ABC, abstractmethod

from trajevo.base.arrays import Array
from trajevo.trajectory.arranged import Arranged
from trajevo.trajectory.interpolants import Variable


class Arrangement(ABC):
    """A map from columns of decision vectors to the points of every individual, for a whole population at once.

    Arrangements wrap one another: one that orders visits gathers the points of an inner one, which may choose postures
    of a robot whose base another one moves. The columns of the wrapped arrangement come first.
    """

    @property
    @abstractmethod
    def variables(self) -> tuple[Variable, ...]:
        """The decision variables, in the order of the columns."""

    @property
    @abstractmethod
    def branches(self) -> Array:
        """Joint positions of every branch of every pose at one arrangement, shape (K, C, n_joints) [rad or m]."""

    @property
    @abstractmethod
    def nominal(self) -> Array:
        """Joint positions of the points at one arrangement that reaches all of them, (K, n_joints) [rad or m]."""

    @property
    @abstractmethod
    def still(self) -> Array:
        """Whether a place has the same joint positions in all arrangements, shape (K,)."""

    @property
    @abstractmethod
    def positions(self) -> Array:
        """Positions of the tool at the points, in the given order and in the cell, shape (K, 3) [m]."""

    @property
    @abstractmethod
    def base_origin(self) -> Array | None:
        """Origin of the robot's base at its given place, shape (3,) [m]; None if the base stands still."""

    @property
    @abstractmethod
    def base_tilts(self) -> bool:
        """Whether the robot's base may be tilted."""

    @abstractmethod
    def __call__(self, columns: Array, branch: Array | None = None) -> Arranged:
        """Where the points lie.

        Args:
            columns: values of :attr:`variables`, shape (B, n_variables); complex ones stay complex.
            branch: number of the branch of each pose, shape (B, K); the first one of each if None. Arrangements that
                choose it themselves take none.
        """
