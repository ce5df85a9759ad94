"""Objects that Python offers to scenes: meshes and points from arrays; shapes, forces, edits and constraints from
functions."""
import ctypes
import itertools
from ctypes import byref, c_void_p

import numpy

from ._library import (Column, Distance, NodeCall, NodeColumn, NodeParameter, NodeType, Release, Shape as ShapeStruct, call,
                       encoded, get, sized, to_value)

_types = {numpy.dtype(numpy.float32): {1: 0, 3: 1, 4: 4}, numpy.dtype(numpy.int32): {1: 2},
          numpy.dtype(numpy.int64): {1: 3}}


_string = 6


def _tokens(array):
    """Returns the library's tokens for strings."""
    strings, indices = numpy.unique(array, return_inverse=True)
    tokens = [get("frame_token_of", encoded(str(text)), ctypes.c_uint32()).value for text in strings]
    return numpy.array(tokens, numpy.uint32)[indices]


class _Arrays:
    """The arrays of one callback. They are copies, because the library's memory ends with the call and a program may
    keep the arrays. give_back() stores the outputs and makes all arrays read-only, so a late write raises
    ValueError."""

    def __init__(self):
        self._all, self._outputs = [], []

    def add(self, pointer, shape, output=False):
        memory = numpy.ctypeslib.as_array(pointer, shape=shape)
        array = memory.copy()
        self._all.append(array)
        if output:
            self._outputs.append((memory, array))
        return array

    def give_back(self):
        for memory, array in self._outputs:
            memory[:] = array
        for array in self._all:
            array.flags.writeable = False


def _numbers_of(array, name):
    """Converts an array of real numbers to float32."""
    array = numpy.asarray(array)
    if array.dtype.kind not in "fiub":
        raise TypeError(f"{name} has the type {array.dtype}; it must contain numbers")
    return numpy.ascontiguousarray(array, numpy.float32)


def _indices_of(array, name):
    """Converts an array of integers to int32."""
    array = numpy.asarray(array)
    if array.dtype.kind not in "iu" and array.size > 0:
        raise TypeError(f"{name} have the type {array.dtype}; they must be integers")
    if array.size > 0 and not (array.min() >= -2**31 and array.max() < 2**31):
        raise ValueError(f"{name} are from {array.min()} to {array.max()}; they must fit into 32 bits")
    return numpy.ascontiguousarray(array, numpy.int32)


class Points:
    """Points from arrays, as from_numpy() returns them."""

    def __init__(self, P, columns):
        arrays = {"P": _numbers_of(P, "P"), **columns}
        if arrays["P"].ndim != 2 or arrays["P"].shape[1] != 3:
            raise TypeError(f"P has the shape {arrays['P'].shape}; it must be (points, 3)")
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
                raise TypeError(f"{name} has the shape {array.shape} and the type {array.dtype}; it must be ({self._count},), "
                                f"({self._count}, 3) or ({self._count}, 4), of floats, int32 or int64, or "
                                f"({self._count},) of str")
            self._arrays[name] = (numpy.ascontiguousarray(array), _types[array.dtype][width])

    def offer(self, offers, name, _callbacks):
        columns = (Column * len(self._arrays))()
        for index, (attribute, (array, type_)) in enumerate(self._arrays.items()):
            columns[index].name, columns[index].type, columns[index].data = encoded(attribute), type_, array.ctypes.data
        call("offers_points", offers, encoded(name), self._count, columns, len(columns))


def from_numpy(P, **columns):
    """Returns points for a scene. P has the shape (points, 3). Other columns have the shape (points,) for numbers and
    strings, (points, 3) for vectors, or (points, 4) for quaternions. The arrays are copied when the points are
    offered."""
    return Points(P, columns)


class Mesh:
    """A triangle mesh. positions has the shape (n, 3). triangles has the shape (m, 3) and holds indices, in
    counter-clockwise order as seen from outside. If it is offered again for each frame, it moves (Scene.offer)."""

    def __init__(self, positions, triangles):
        self._positions = _numbers_of(positions, "positions")
        self._triangles = _indices_of(triangles, "triangles")
        for what, array in (("positions", self._positions), ("triangles", self._triangles)):
            if array.ndim != 2 or array.shape[1] != 3:
                raise TypeError(f"{what} have the shape {array.shape}; it must be (n, 3)")

    def offer(self, offers, name, _callbacks):
        call("offers_mesh", offers, encoded(name), self._positions.ctypes.data, len(self._positions),
             self._triangles.ctypes.data, len(self._triangles))


class Shape:
    """A shape defined by its signed distance, which is negative inside. distance(P, gradient) returns the distances at
    the positions P: an array of shape (n,) for P of shape (n, 3). Unless gradient is None, the function also writes the
    gradient of the distance into it, of shape (n, 3). lower and upper are the corners of a box around the shape.
    slope_bound is the largest length of the gradient, and smallest_feature the size of the finest detail in metres."""

    def __init__(self, distance, lower=(-numpy.inf,) * 3, upper=(numpy.inf,) * 3, slope_bound=1, smallest_feature=0):
        self._distance, self._lower, self._upper = distance, lower, upper
        self._slope_bound, self._smallest_feature = slope_bound, smallest_feature

    def offer(self, offers, name, callbacks):
        shape = sized(ShapeStruct)
        shape.lower[:], shape.upper[:] = self._lower, self._upper
        shape.slope_bound, shape.smallest_feature = self._slope_bound, self._smallest_feature

        def distance(_, n, P, phi, gradient):
            arrays = _Arrays()
            slope = arrays.add(gradient, (n, 3), output=True) if gradient else None
            distances = numpy.asarray(self._distance(arrays.add(P, (n, 3)), slope))
            if distances.dtype.kind not in "fiub":
                raise TypeError(f"the distance has the type {distances.dtype}; it must contain numbers")
            if distances.shape not in ((), (n,)):
                raise ValueError(f"the distance has the shape {distances.shape}; it must be ({n},), one for each position")
            numpy.ctypeslib.as_array(phi, shape=(n,))[:] = distances
            arrays.give_back()
            return 0
        shape.distance = Distance(callbacks.guard(distance, 1))
        callbacks.append(shape.distance)
        call("offers_shape", offers, encoded(name), byref(shape))


class _Node:
    def __init__(self, name, function, doc="", parameters=None, reads=(), writes=()):
        self._name, self._function, self._doc, self._parameters = name, function, doc, parameters or {}
        self._reads, self._writes = self._columns(reads), self._columns(writes)

    @staticmethod
    def _columns(names):
        """Returns (name, width) pairs for a list of names, or for {name: 1 or 3}. In a list, P, v, N and Cd are
        vectors, and all others are numbers."""
        widths = names if isinstance(names, dict) else {n: 3 if n in ("P", "v", "N", "Cd") else 1 for n in names}
        return list(widths.items())

    def offer_node(self, offers, callbacks):
        node = sized(NodeType)
        node.name, node.doc, node.kind = encoded(self._name), encoded(self._doc), self._kind
        parameters = (NodeParameter * len(self._parameters))()
        for index, (name, value) in enumerate(self._parameters.items()):
            parameters[index].name, parameters[index].doc = encoded(name), b""
            parameters[index].fallback = to_value(value, name)
        node.parameters, node.parameter_count = parameters, len(parameters)
        for what, columns in (("read", self._reads), ("write", self._writes)):
            array = (NodeColumn * len(columns))()
            for index, (name, width) in enumerate(columns):
                array[index].name, array[index].type = encoded(name), 1 if width == 3 else 0
            setattr(node, what + "s", array)
            setattr(node, what + "_count", len(columns))
        node.call = NodeCall(callbacks.guard(lambda _, now: self._run(now.contents), 1))
        callbacks.append(node.call)
        call("offers_node", offers, byref(node))

    def _run(self, now):
        numbers, at = {}, 0
        for name, value in self._parameters.items():
            wide = to_value(value, name).type == 3
            numbers[name] = numpy.array(now.parameters[at:at + 3]) if wide else now.parameters[at]
            at += 3 if wide else 1
        arrays = _Arrays()
        self._call(Now(now, self, arrays), numbers)
        arrays.give_back()
        return 0


class Now:
    """The argument of a node's function: count is the number of points, frame, time and dt describe the step.
    now["heat"] is a column that the node reads or writes. A force also gets P and v, an edit gets kill, a constraint
    gets P and id. After the call the arrays are read-only copies."""

    def __init__(self, now, node, arrays):
        self.count, self.frame, self.time, self.dt = now.count, now.frame, now.time, now.dt
        self._now, self._columns = now, {}
        one, three = (now.count,), (now.count, 3)
        for pointers, columns, output in ((now.reads, node._reads, False), (now.writes, node._writes, True)):
            for index, (name, width) in enumerate(columns):
                self._columns[name] = arrays.add(pointers[index], one if width == 1 else three, output)
        if now.id:
            self.P, self.id = arrays.add(now.P, three), arrays.add(now.id, one)
        elif now.P:
            self.P, self.v = arrays.add(now.P, three), arrays.add(now.v, three)
            self.acceleration = arrays.add(now.acceleration, three, output=True)
        if now.kill:
            self.kill = arrays.add(now.kill, one, output=True)

    def __getitem__(self, name):
        return self._columns[name]


class Force(_Node):
    """A force. function(now, **parameters) returns accelerations in m/s², of shape (count, 3). It is called for chunks
    of points in each substep."""
    _kind = 0

    def _call(self, now, numbers):
        now.acceleration[:] = self._function(now, **numbers)


class Edit(_Node):
    """An edit of the points. function(now, **parameters) changes the columns that it writes, and may set now.kill to
    remove points. It is called once per frame."""
    _kind = 1

    def _call(self, now, numbers):
        self._function(now, **numbers)


class Constraint(_Node):
    """A constraint. function(now, **parameters) returns rods between the points now.id at now.P, as a list of (id, id,
    length in m, compliance in m/N). It is called once per frame."""
    _kind = 2

    def _call(self, now, numbers):
        for a, b, length, compliance in self._function(now, **numbers):
            call("call_add_rod", byref(now._now), int(a), int(b), length, compliance)


class Callbacks(list):
    """The callbacks of a set of offers. guard(function, otherwise) wraps a function and stores its exception."""

    def __init__(self, guard):
        super().__init__()
        self.guard = guard


_used_callbacks = {}  # callbacks by number, while the library may call them
_numbers = itertools.count(1)
_forget = Release(lambda number: _used_callbacks.pop(number, None))


def make_offers(objects, nodes, guard):
    """Returns a handle to all offered objects and nodes. guard: see Callbacks."""
    offers = c_void_p()
    call("offers_new", byref(offers))
    try:
        number = next(_numbers)
        callbacks = _used_callbacks[number] = Callbacks(guard)
        call("offers_on_release", offers, _forget, number)
        for name, thing in objects.items():
            if not isinstance(thing, (Points, Mesh, Shape)):
                raise TypeError(f"{name} is a {type(thing).__name__}; it must be made by rapid.from_numpy, rapid.Mesh or "
                                "rapid.Shape")
            thing.offer(offers, name, callbacks)
        for node in nodes:
            if not isinstance(node, _Node):
                raise TypeError(f"a node is a {type(node).__name__}; it must be rapid.Force, rapid.Edit or "
                                "rapid.Constraint")
            node.offer_node(offers, callbacks)
    except BaseException:
        call("offers_release", offers)
        raise
    return offers
