#!/usr/bin/env python3
"""Solves jerk-limited motions with the official ruckig library, to compare the trajectory crate with.

Reads problems as CSV on stdin, one a line, without a header:
    angle, speed, acceleration, target_angle, max_speed, max_acceleration, max_jerk, sample_interval, samples
in rad, rad/s, rad/s^2, rad/s^3 and s. Writes one line for each: the duration in s, then angle, speed and acceleration
at sample_interval, 2*sample_interval, ...; beyond the end they stay at the target. `nan` where there is no solution.

Needs the PyPI package `ruckig`:  python3 -m venv tools/.venv && tools/.venv/bin/pip install ruckig
"""
import sys

from ruckig import InputParameter, Result, Ruckig, RuckigError, Trajectory


def solve(numbers):
    angle, speed, acceleration, target, max_speed, max_acceleration, max_jerk, interval, samples = numbers
    problem = InputParameter(1)
    problem.current_position = [angle]
    problem.current_velocity = [speed]
    problem.current_acceleration = [acceleration]
    problem.target_position = [target]
    problem.max_velocity = [max_speed]
    problem.max_acceleration = [max_acceleration]
    problem.max_jerk = [max_jerk]
    trajectory = Trajectory(1)
    try:
        result = Ruckig(1).calculate(problem, trajectory)
    except RuckigError:
        # Its own numbers fail at some points of huge jerk; it says so, and has no solution.
        result = Result.ErrorExecutionTimeCalculation
    if result not in (Result.Working, Result.Finished):
        return [float("nan")]
    row = [trajectory.duration]
    for i in range(1, int(samples) + 1):
        time = min(i * interval, trajectory.duration)
        for values in trajectory.at_time(time):
            row.append(values[0])
    return row


def main():
    for line in sys.stdin:
        if line.strip():
            print(",".join(repr(number) for number in solve([float(word) for word in line.split(",")])))


if __name__ == "__main__":
    main()
