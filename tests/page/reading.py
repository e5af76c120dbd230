"""What a page holds, read as its scripts read it, and worked out with numpy: a second opinion on them."""

import base64
import gzip
import json
import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np


@dataclass(frozen=True, eq=False)
class Page:
    """A page: its text, its data, and its arrays."""

    text: str
    data: dict
    buffer: bytes

    @classmethod
    def of(cls, file: Path) -> "Page":
        text = Path(file).read_text(encoding="utf-8")
        held = {
            name: re.search(rf'<script [^>]*id="{name}">(.*?)</script>', text, re.DOTALL) for name in ("data", "arrays")
        }
        return cls(text, json.loads(held["data"][1]), gzip.decompress(base64.b64decode(held["arrays"][1])))

    def array(self, place):
        count = math.prod(place["shape"])
        return np.frombuffer(self.buffer, f"<{place['type']}", count, place["at"]).reshape(place["shape"])

    def members(self, name):
        return self.array(self.data["members"][name])

    def values(self, row, time, order):
        """A derivative of all joints at an instant, (n_joints,)."""
        breaks, coefficients = self.members("breaks")[row], self.members("coefficients")[row].astype(float)
        segment = int(np.clip(np.searchsorted(breaks, time, side="right") - 1, 0, len(breaks) - 2))
        local = time - float(breaks[segment])
        return np.array([np.polyval(np.polyder(line[::-1], order), local) for line in coefficients[segment]])

    def model(self, row, time):
        """Positions of the model's joints at an instant."""
        if "model" in self.data["members"]:
            places = self.members("model")[row] * np.array(self.data["members"]["model_scale"])
            shares = np.linspace(0.0, float(self.members("breaks")[row, -1]), len(places))
            return np.array([np.interp(time, shares, column) for column in places.T])
        q, leads = self.values(row, time, 0), self.data["arm"]["leads"]
        return q if leads is None else np.array(leads) @ np.append(q, 1.0)

    def frames(self, row, time):
        """Frames of all joints of the model, and of the tool, (n_model + 1, 4, 4)."""
        arm, q = self.data["arm"], self.model(row, time)
        found = []
        for k, parent in enumerate(arm["parents"]):
            own, axis = np.eye(4), np.array(arm["axes"][k])
            if arm["turns"][k]:
                own[:3, :3] = _turned(axis, q[arm["columns"][k]])
            else:
                own[:3, 3] = q[arm["columns"][k]] * axis
            before = found[parent - 1] if parent else np.eye(4)
            found.append(before @ np.array(arm["places"][k]).reshape(4, 4).T @ own)
        tool = arm["tool"]
        last = found[tool["joint"] - 1] if tool["joint"] else np.eye(4)
        return np.array([*found, last @ np.array(tool["place"]).reshape(4, 4).T])

    def surfaces(self, kind):
        """Number of the joint and corners, (N, 3), of all surfaces of a kind."""
        return [
            (one["joint"], self.array(one["vertices"]).astype(float))
            for one in self.data["arm"]["surfaces"]
            if one["kind"] == kind
        ]


def _turned(axis, angle):
    x, y, z = axis
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * across + (1.0 - np.cos(angle)) * across @ across
