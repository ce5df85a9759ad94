"""What Python offers to scenes: arrays as meshes and points, functions of arrays as shapes, forces and edits."""
import ctypes
from ctypes import byref, c_void_p

import numpy

from ._library import (Column, Distance, NodeCall, NodeColumn, NodeParameter, NodeType, Shape as ShapeStruct, call, get, sized,
                       to_value)

_types = {numpy.dtype(numpy.float32): {1: 0, 3: 1, 4: 4}, numpy.dtype(numpy.int32): {1: 2},
          numpy.dtype(numpy.int64): {1: 3}}


_string = 6


def _tokens(array):
    """The library's numbers of texts."""
    texts, places = numpy.unique(array, return_inverse=True)
    tokens = [get("text_token", str(text).encode(), ctypes.c_uint32()).value for text in texts]
    return numpy.array(tokens, numpy.uint32)[places]


def _array(pointer, shape):
    """An array of the memory at a pointer of ctypes."""
    return numpy.ctypeslib.as_array(pointer, shape=shape)


class Points:
    """Points of arrays: see from_numpy()."""

    def __init__(self, P, columns):
        arrays = {"P": numpy.asarray(P, numpy.float32), **columns}
        if arrays["P"].ndim != 2 or arrays["P"].shape[1] != 3:
            raise TypeError(f"P is of shape {arrays['P'].shape}; it must be (points, 3)")
        self._count, self._arrays = len(arrays["P"]), {}
        for name, array in arrays.items():
            array = numpy.asarray(array)
            if array.dtype == numpy.float64:
                array = array.astype(numpy.float32)
            if array.dtype.kind == "U" and array.ndim == 1 and len(array) == self._count:
                self._arrays[name] = (_tokens(array), _string)
                continue
            width = 1 if array.ndim == 1 else array.shape[-1]
            if array.ndim not in (1, 2) or len(array) != self._count or width not in _types.get(array.dtype, {}):
                raise TypeError(f"{name} is of shape {array.shape} and {array.dtype}; it must be of ({self._count},), "
                                f"({self._count}, 3) or ({self._count}, 4), of floats, int32 or int64, or "
                                f"({self._count},) of str")
            self._arrays[name] = (numpy.ascontiguousarray(array), _types[array.dtype][width])

    def offer(self, offers, name, _held):
        columns = (Column * len(self._arrays))()
        for place, (attribute, (array, type_)) in enumerate(self._arrays.items()):
            columns[place].name, columns[place].type, columns[place].data = attribute.encode(), type_, array.ctypes.data
        call("offers_points", offers, name.encode(), self._count, columns, len(columns))


def from_numpy(P, **columns):
    """Points for a scene: P of shape (points, 3), and any other columns: of shape (points,), (points, 3) or, quaternions,
    (points, 4); of texts, (points,) of str. They are copied when they are offered."""
    return Points(P, columns)


class Mesh:
    """A triangle mesh: positions of shape (n, 3), triangles of shape (m, 3), counter-clockwise seen from outside."""

    def __init__(self, positions, triangles):
        self._positions = numpy.ascontiguousarray(positions, numpy.float32)
        self._triangles = numpy.ascontiguousarray(triangles, numpy.int32)
        for what, array in (("positions", self._positions), ("triangles", self._triangles)):
            if array.ndim != 2 or array.shape[1] != 3:
                raise TypeError(f"{what} are of shape {array.shape}; it must be (n, 3)")

    def offer(self, offers, name, _held):
        call("offers_mesh", offers, name.encode(), self._positions.ctypes.data, len(self._positions),
             self._triangles.ctypes.data, len(self._triangles))


class Shape:
    """A shape by its signed distance. distance(P, gradient) returns the distances, shape (n,), of the places P, shape
    (n, 3), negative inside; unless gradient is None it writes that of the distance there, shape (n, 3)."""

    def __init__(self, distance, lower=(-numpy.inf,) * 3, upper=(numpy.inf,) * 3, slope_bound=1, smallest_feature=0):
        self._distance, self._lower, self._upper = distance, lower, upper
        self._slope_bound, self._smallest_feature = slope_bound, smallest_feature

    def offer(self, offers, name, held):
        shape = sized(ShapeStruct)
        shape.lower[:], shape.upper[:] = self._lower, self._upper
        shape.slope_bound, shape.smallest_feature = self._slope_bound, self._smallest_feature

        def distance(_, n, P, phi, gradient):
            _array(phi, (n,))[:] = self._distance(_array(P, (n, 3)), _array(gradient, (n, 3)) if gradient else None)
            return 0
        shape.distance = Distance(held.guard(distance, 1))
        held.append(shape.distance)
        call("offers_shape", offers, name.encode(), byref(shape))


class _Node:
    def __init__(self, name, function, doc="", parameters=None, reads=(), writes=()):
        self._name, self._function, self._doc, self._parameters = name, function, doc, parameters or {}
        self._reads, self._writes = self._columns(reads), self._columns(writes)

    @staticmethod
    def _columns(names):
        """Names, or {name: 1 or 3}: P, v, N, Cd are vectors, others numbers."""
        widths = names if isinstance(names, dict) else {n: 3 if n in ("P", "v", "N", "Cd") else 1 for n in names}
        return list(widths.items())

    def offer_node(self, offers, held):
        node = sized(NodeType)
        node.name, node.doc, node.kind = self._name.encode(), self._doc.encode(), self._kind
        parameters = (NodeParameter * len(self._parameters))()
        for place, (name, value) in enumerate(self._parameters.items()):
            parameters[place].name, parameters[place].doc = name.encode(), b""
            parameters[place].fallback = to_value(value, name)
        node.parameters, node.parameter_count = parameters, len(parameters)
        for what, columns in (("read", self._reads), ("write", self._writes)):
            array = (NodeColumn * len(columns))()
            for place, (name, width) in enumerate(columns):
                array[place].name, array[place].type = name.encode(), 1 if width == 3 else 0
            setattr(node, what + "s", array)
            setattr(node, what + "_count", len(columns))
        node.call = NodeCall(held.guard(lambda _, now: self._run(now.contents), 1))
        held.append(node.call)
        call("offers_node", offers, byref(node))

    def _run(self, now):
        numbers, at = {}, 0
        for name, value in self._parameters.items():
            wide = to_value(value, name).type == 3
            numbers[name] = numpy.array(now.parameters[at:at + 3]) if wide else now.parameters[at]
            at += 3 if wide else 1
        self._call(Now(now, self), numbers)
        return 0


class Now:
    """What a node's function works on: count, frame, time, dt; now["heat"] is a column that it reads or writes; of a force P
    and v, of an edit kill."""

    def __init__(self, now, node):
        self.count, self.frame, self.time, self.dt = now.count, now.frame, now.time, now.dt
        self._now, self._columns = now, {}
        for pointers, columns in ((now.reads, node._reads), (now.writes, node._writes)):
            for place, (name, width) in enumerate(columns):
                shape = (now.count,) if width == 1 else (now.count, 3)
                self._columns[name] = _array(pointers[place], shape)
        if now.id:
            self.P, self.id = _array(now.P, (now.count, 3)), _array(now.id, (now.count,))
        elif now.P:
            self.P, self.v = _array(now.P, (now.count, 3)), _array(now.v, (now.count, 3))
            self.acceleration = _array(now.acceleration, (now.count, 3))
        if now.kill:
            self.kill = _array(now.kill, (now.count,))

    def __getitem__(self, name):
        return self._columns[name]


class Force(_Node):
    """A force: function(now, **parameters) returns accelerations, shape (count, 3), m/s². It is called for chunks of points
    in each sub-step."""
    _kind = 0

    def _call(self, now, numbers):
        now.acceleration[:] = self._function(now, **numbers)


class Edit(_Node):
    """An edit: function(now, **parameters) changes the columns that it writes, and sets now.kill, once a frame."""
    _kind = 1

    def _call(self, now, numbers):
        self._function(now, **numbers)


class Constraint(_Node):
    """A constraint: function(now, **parameters) returns rods [(id, id, length in m, compliance in m/N), ...] for the points
    now.id at now.P, once a frame."""
    _kind = 2

    def _call(self, now, numbers):
        for a, b, length, compliance in self._function(now, **numbers):
            call("call_add_rod", byref(now._now), int(a), int(b), length, compliance)


class Held(list):
    """Callbacks, as long as the scene that calls them lives; guard() keeps what they raise."""

    def __init__(self, guard):
        super().__init__()
        self.guard = guard


def make_offers(objects, nodes, guard_callbacks, held):
    """A handle of all that is offered."""
    offers = c_void_p()
    call("offers_new", byref(offers))
    try:
        call("offers_guard", offers, int(guard_callbacks))
        for name, thing in objects.items():
            if not hasattr(thing, "offer"):
                raise TypeError(f"{name} is a {type(thing).__name__}; it must be of rapid.from_numpy, rapid.Mesh or "
                                "rapid.Shape")
            thing.offer(offers, name, held)
        for node in nodes:
            node.offer_node(offers, held)
    except BaseException:
        call("offers_release", offers)
        raise
    return offers
