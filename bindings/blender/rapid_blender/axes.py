"""Conversion between Blender's space (z up, in units) and Rapid's (y up, in metres): (x, y, z) <-> (x, z, -y)."""
import numpy


def to_rapid(vectors, scale=1.0):
    """Converts vectors of shape (n, 3). scale: metres per unit."""
    result = numpy.empty((len(vectors), 3), numpy.float32)
    result[:, 0], result[:, 1] = vectors[:, 0], vectors[:, 2]
    numpy.negative(vectors[:, 1], out=result[:, 2])
    if scale != 1:
        result *= numpy.float32(scale)
    return result


def to_blender(vectors, scale=1.0):
    result = numpy.empty((len(vectors), 3), numpy.float32)
    result[:, 0], result[:, 2] = vectors[:, 0], vectors[:, 1]
    numpy.negative(vectors[:, 2], out=result[:, 1])
    if scale != 1:
        result /= numpy.float32(scale)
    return result


def to_euler(orient):
    """Converts quaternions x y z w of Rapid to Euler angles of Blender: XYZ, radians.

    With y and z exchanged as above, R = Rz(c) Ry(b) Rx(a). At b = +-90 degrees only the sum or the difference of a and c
    is defined, and a is 0.
    """
    x, y, z, w = numpy.asarray(orient, numpy.float64).T
    y, z = -z, y
    length = numpy.sqrt(x * x + y * y + z * z + w * w)
    length[length == 0] = 1
    x, y, z, w = x / length, y / length, z / length, w / length
    sine = numpy.clip(2 * (w * y - z * x), -1, 1)
    a = numpy.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    c = numpy.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    locked = numpy.abs(sine) > 1 - 1e-12
    a = numpy.where(locked, 0, a)
    c = numpy.where(locked, numpy.arctan2(2 * (w * z - x * y), 1 - 2 * (x * x + z * z)), c)
    return numpy.stack([a, numpy.arcsin(sine), c], 1).astype(numpy.float32)
