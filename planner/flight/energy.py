"""How much energy a flight takes: a proxy that compares plans, not a promise of a battery."""

import numpy as np

from planner.flight.timing import Timeline
from planner.geometry import bezier
from planner.geometry.arrays import Floats

BLADE, INDUCED = 79.86, 88.63
"""Power of the blades' drag and of lift in hovering, watts, of an aircraft of 20 newtons."""

TIP_SPEED, INDUCED_SPEED = 120.0, 4.03
"""Speed of the blade tips and of the induced air in hovering, metres a second."""

DRAG = 0.5 * 0.6 * 1.225 * 0.05 * 0.503
"""Half of drag ratio, air density, rotor solidity and disc area: watts at 1 m/s."""

WEIGHT = 20.0
"""Newtons."""

STEP = 0.05
"""Seconds between the places at which power is looked at."""


def power(speed: Floats) -> Floats:
    r"""Power of a rotary wing in level flight, watts.

    .. math::

        P = P_0 (1 + 3 v^2 / U^2) + P_i (\sqrt{1 + v^4 / 4 v_0^4} - v^2 / 2 v_0^2)^{1/2}
            + \tfrac12 d \rho s A v^3

    with the aircraft of Zeng, Xu and Zhang, "Energy Minimization for Wireless Communication With
    Rotary-Wing UAV", IEEE Transactions on Wireless Communications 18(4), 2019
    (doi:10.1109/TWC.2019.2902559).

    Parameters
    ----------
    speed
        Metres a second, any shape.

    """
    square = np.asarray(speed) ** 2
    ratio = square / (2.0 * INDUCED_SPEED**2)
    lift = INDUCED * np.sqrt(np.sqrt(1.0 + ratio**2) - ratio)
    return np.asarray(
        BLADE * (1.0 + 3.0 * square / TIP_SPEED**2) + lift + DRAG * np.asarray(speed) ** 3
    )


def energy(timeline: Timeline) -> float:
    """Energy of a flight, joules: power over time, and weight times all climbs.

    What descending could give back is not counted, nor wind, nor payload.
    """
    if not len(timeline.path):
        return float(power(np.zeros(1))[0]) * timeline.duration
    t = np.linspace(0.0, timeline.duration, int(np.ceil(timeline.duration / STEP)) + 2)
    piece, parameter, speed = timeline.at(t)
    height = bezier.evaluate(timeline.path.controls[piece], parameter)[:, 2]
    climb = float(np.diff(height).clip(0.0).sum())
    return float(np.trapezoid(power(speed), t)) + WEIGHT * climb


def climb_energy(height: float, seconds: float) -> float:
    """Energy of a climb and the descent from it: the power of hovering, and weight times height.

    Parameters
    ----------
    height
        Metres.
    seconds
        Of climb and descent together.

    """
    return float(power(np.zeros(1))[0]) * seconds + WEIGHT * height
