"""What objectives and constraints look at: a robot and a batch of its trajectories."""

from __future__ import annotations

from dataclasses import dataclass

from trajevo.errors import InvalidInputError
from trajevo.robot import Robot
from trajevo.trajectory import TrajectoryBatch


@dataclass(frozen=True, eq=False)
class Rollout:
    """A batch of trajectories of a robot.

    Attributes:
        robot: the robot that moves.
        trajectory: B trajectories of its joints.
    """

    robot: Robot
    trajectory: TrajectoryBatch

    def __post_init__(self) -> None:
        if self.trajectory.n_joints != self.robot.dof:
            raise InvalidInputError(
                f"trajectory: robot {self.robot.name!r} has {self.robot.dof} joints, "
                f"got a trajectory of {self.trajectory.n_joints}"
            )
