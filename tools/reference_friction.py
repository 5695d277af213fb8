#!/usr/bin/env python3
"""Checks the friction torque of a given motion against SciPy's Radau at rtol 1e-9.

    cargo run -q --release -p valve-model --example friction_trace | tools/reference_friction.py

Reads cases (`# law parameters...`, then rows of time, speed, torque), integrates the same equations, written here
anew, with the speed linear between samples, and prints the greatest difference of each case. Exits 1 where one is
beyond its bound.
"""

import sys

import numpy as np
from scipy.integrate import solve_ivp

# Greatest difference accepted, in parts of the Coulomb torque.
BOUND = 1e-4


def curve(speed, coulomb, static, velocity, exponent):
    return coulomb + (static - coulomb) * np.exp(-np.abs(speed / velocity) ** exponent)


def lugre(parameters):
    coulomb, static, velocity, exponent, stiffness, damping, viscous = parameters

    def rate(speed, z):
        return speed - stiffness * abs(speed) * z / curve(speed, coulomb, static, velocity, exponent)

    def torque(speed, z):
        return stiffness * z + damping * rate(speed, z) + viscous * speed

    return rate, torque


def dahl(parameters):
    coulomb, stiffness, viscous, exponent = parameters

    def rate(speed, z):
        distance = 1.0 - np.sign(speed) * stiffness * z / coulomb
        return speed * np.abs(distance) ** exponent * np.sign(distance)

    def torque(speed, z):
        return stiffness * z + viscous * speed

    return rate, torque


def leuven(parameters):
    """With elements that never slip, so that F_h = sigma0 * z."""
    *curve_parameters, stiffness, damping, viscous, exponent = parameters

    def rate(speed, z):
        reached = np.sign(speed) * stiffness * z / curve(speed, *curve_parameters)
        return speed * (1.0 - np.sign(reached) * np.abs(reached) ** exponent)

    def torque(speed, z):
        return stiffness * z + damping * rate(speed, z) + viscous * speed

    return rate, torque


LAWS = {"lugre": lugre, "dahl": dahl, "leuven": leuven}


def cases(lines):
    head, rows = None, []
    for line in lines:
        if line.startswith("#"):
            if head:
                yield head, np.array(rows)
            head, rows = line[1:].split(), []
        elif line.strip():
            rows.append([float(field) for field in line.split()])
    if head:
        yield head, np.array(rows)


def longest(left, right, low, high, velocity):
    """The solver's longest step: an error estimate can leap over the curve's narrow fall near zero speed."""
    if velocity is None or min(abs(low), abs(high)) > 7.0 * velocity:
        return right - left
    return (right - left) / max(1.0, np.ceil(5.0 * abs(high - low) / velocity))


def reference(rate, scale, velocity, times, speeds):
    """z at `times`, from 0 at rest; integrated piecewise between samples and changes of sign."""
    z, begin, start = 0.0, 0.0, 0.0
    found = []
    for time, end in zip(times, speeds):
        cuts = [begin, time]
        if start * end < 0.0:
            cuts.insert(1, begin + (time - begin) * start / (start - end))
        for left, right in zip(cuts, cuts[1:]):
            middle = np.interp(0.5 * (left + right), [begin, time], [start, end])

            def derivative(t, y, begin=begin, time=time, start=start, end=end, sign=np.sign(middle)):
                speed = start + (end - start) * (t - begin) / (time - begin)
                # At the cut itself the sign is that of the piece.
                return [rate(sign * abs(speed), y[0])]

            low, high = np.interp([left, right], [begin, time], [start, end])
            step = longest(left, right, low, high, velocity)
            piece = solve_ivp(
                derivative, (left, right), [z], method="Radau", rtol=1e-9, atol=1e-12 * scale, max_step=step
            )
            if not piece.success:
                raise RuntimeError(piece.message)
            z = piece.y[0, -1]
        begin, start = time, end
        found.append(z)
    return np.array(found)


def main():
    failed = False
    for head, rows in cases(sys.stdin):
        law, parameters = head[0], [float(field) for field in head[1:]]
        rate, torque = LAWS[law](parameters)
        coulomb = parameters[0]
        stiffness = parameters[1] if law == "dahl" else parameters[4]
        times, speeds, torques = rows.T
        velocity = None if law == "dahl" else parameters[2]
        z = reference(rate, coulomb / stiffness, velocity, times, speeds)
        expected = np.array([torque(speed, value) for speed, value in zip(speeds, z)])
        worst = np.max(np.abs(torques - expected)) / coulomb
        verdict = "ok" if worst <= BOUND else f"beyond {BOUND}"
        failed |= worst > BOUND
        print(f"{' '.join(head)}: {worst:.2e} of the Coulomb torque, {verdict}")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
