"""Opens graphs/first.lua, puts a ball of its own in the place of the torus, and prints the mean height of the beads.

    python3 first.py graphs/first.lua
"""
import sys

import numpy

import rapid

CENTER, RADIUS = numpy.array([0, 0.7, 0]), 0.7  # m


def ball(P, gradient):
    d = P - CENTER
    length = numpy.linalg.norm(d, axis=1)
    if gradient is not None:
        gradient[:] = d / numpy.maximum(length, 1e-300)[:, None]
    return length - RADIUS


def main():
    file = sys.argv[1] if len(sys.argv) > 1 else "graphs/first.lua"
    shape = rapid.Shape(ball, CENTER - RADIUS, CENTER + RADIUS)
    scene = rapid.Scene(file, rate=5000, objects={"ball": shape}, set={"collide1.shape": "host:ball"})
    for number in range(24, 97, 24):
        frame = scene.advance_to(number)
        P = frame["P"]  # shares memory with the run
        nearest = numpy.linalg.norm(P.astype(float) - CENTER, axis=1).min()
        print(f"frame {number}: {len(P)} points, mean height {P[:, 1].astype(float).mean():.4f} m, "
              f"nearest to the ball's middle {nearest:.3f} m")


try:
    main()
except rapid.Error as error:
    sys.exit(f"{error}")
