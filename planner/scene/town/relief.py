"""Gentle ground: a few long waves."""

from dataclasses import dataclass

import numpy as np

from planner.geometry.arrays import Floats


@dataclass(frozen=True, slots=True, eq=False)
class Relief:
    """Sum of three plane waves, metres.

    Parameters
    ----------
    waves
        Wave vectors, shape (3, 2), radians a metre.
    phases
        Shape (3,), radians.
    amplitude
        Largest height above or below zero, metres.

    """

    waves: Floats
    phases: Floats
    amplitude: float

    def height(self, xy: Floats) -> Floats:
        """Height at each point, shape (..., 2) -> (...), metres."""
        angle = np.asarray(xy)[..., None, :2] * self.waves
        waves = np.sin(angle.sum(axis=-1) + self.phases)
        return np.asarray(self.amplitude * waves.mean(axis=-1))


def random_relief(amplitude: float, rng: np.random.Generator) -> Relief:
    """Waves of 70 to 200 m length in any direction."""
    heading = rng.uniform(0.0, 2.0 * np.pi, 3)
    number = 2.0 * np.pi / rng.uniform(70.0, 200.0, 3)
    waves = number[:, None] * np.column_stack([np.cos(heading), np.sin(heading)])
    return Relief(waves, rng.uniform(0.0, 2.0 * np.pi, 3), amplitude)
