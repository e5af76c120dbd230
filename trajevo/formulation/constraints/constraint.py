"""What every constraint is: a pure function of a rollout, at most 0 where feasible, and what is known of it.

A value of 0.05 means that the limit is exceeded by 5 %. Limits that are ``inf`` have no column.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from trajevo.base.arrays import Array
from trajevo.dynamics.rollout import Rollout

#: How a limit is known to hold between samples: by the exact extremes of the motion, by a guaranteed bound, by
#: a proof that cuts the motion into pieces, or not at all, since samples alone are looked at.
Guarantee = Literal["extremes", "bound", "pieces", "samples"]


@dataclass(frozen=True)
class Constraint:
    """Something that must not exceed 0.

    Attributes:
        names: one name per column.
        reference: where the limits stand.
        function: rollout of B trajectories -> (B, len(names)).
        terms: what the columns are the greatest of, in as many columns as that takes, (B, K); None where the columns
            are smooth themselves. A gradient solver goes astray where a greatest passes from one term to another.
        sampled: the same limit at the samples alone, of one that is proven between them.
        quantity: what is limited, as certificates name it: ``"position"``, ``"velocity"``, ``"acceleration"``,
            ``"jerk"``, ``"effort"``, ``"tool speed"``, ``"clearance"`` and the like; ``""`` for something of the
            problem's own of which nothing more is known.
        limit: what the quantity is held to [SI], the same for all columns or one for each; None where a column is
            measured against something else.
        share: which share of the robot's own limit is left to the motion, 1 for all of it; None of what is no limit
            of a robot's joints.
        proof: how it is known to hold between samples.
    """

    names: tuple[str, ...]
    reference: str
    function: Callable[[Rollout], Array]
    terms: Callable[[Rollout], Array] | None = None
    sampled: Constraint | None = None
    quantity: str = ""
    limit: float | tuple[float, ...] | None = None
    share: float | None = None
    proof: Guarantee = "samples"

    @property
    def at_samples(self) -> Constraint:
        """The limit at the samples alone; itself where nothing more is proven."""
        return self if self.sampled is None else self.sampled


def in_terms(constraint: Constraint, example: Rollout) -> Constraint:
    """A constraint with a column for each of its terms; the same where it has none.

    Args:
        constraint: any.
        example: a rollout like those that it will be asked about, which tells how many terms there are.
    """
    if constraint.terms is None:
        return constraint
    count = constraint.terms(example).shape[1]
    names = tuple(f"term {k} of {constraint.names[0]} and the like" for k in range(count))
    return Constraint(names, constraint.reference, constraint.terms)
