"""A bake: Rapid's ordinary output and snapshots in a folder, computed by a thread while Blender goes on.

The folder of a simulation has:

    inputs/      the inputs as files (inputs.py)
    cache/       snapshots and the journal of Rapid, from which a stopped bake continues
    points_OUTPUT.####.npz    the points of each frame, with Rapid's number
    bake.json    the settings of the bake
"""
import hashlib
import json
import os
import pathlib
import shutil
import threading

import bpy

from . import library
from .inputs import Inputs
from .source import Problem, options, problem_of, reload, settings_of, text_of

TEMPORARY = "rapid"  # below Blender's temporary folder, until the .blend is saved


def folder_of(thing):
    """Returns the folder of a simulation's bake."""
    own = thing.rapid
    if own.folder:
        return pathlib.Path(bpy.path.abspath(own.folder, library=thing.library))
    name = bpy.path.clean_name(thing.name)
    if not bpy.data.filepath and not thing.library:
        return pathlib.Path(bpy.app.tempdir) / TEMPORARY / name
    return pathlib.Path(bpy.path.abspath(f"//rapid/{name}", library=thing.library))


def key_of(thing, scene):
    """Returns a hash of all settings on which the frames depend. Rapid itself also compares modules and inputs."""
    own = thing.rapid
    inputs = {one.name: [one.kind, *sorted(each.name for each in one.objects)] for one in own.inputs}
    everything = [text_of(thing)[1], settings_of(thing), inputs, own.start, own.seed, frame_rate(scene),
                  scene.unit_settings.scale_length]
    return hashlib.sha1(json.dumps(everything, sort_keys=True).encode()).hexdigest()


def frame_rate(scene):
    return scene.render.fps / scene.render.fps_base


def record_of(thing):
    """Returns the contents of bake.json, or {} if there is no bake."""
    try:
        return json.loads((folder_of(thing) / "bake.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}


def points_files(thing, frame):
    """Returns the file of each output, by name, for a frame of Blender. They may not exist."""
    number = frame - thing.rapid.start + record_of(thing).get("first", 1)
    return {one.name: folder_of(thing) / f"points_{one.name}.{number:04d}.npz" for one in thing.rapid.outputs}


def free(thing):
    """Removes the bake."""
    folder = folder_of(thing)
    remove_points(folder)
    for name in ("cache", "inputs"):
        shutil.rmtree(folder / name, ignore_errors=True)
    (folder / "bake.json").unlink(missing_ok=True)
    if folder.is_dir() and not any(folder.iterdir()):
        folder.rmdir()


def remove_points(folder):
    for path in folder.glob("points_*.npz"):
        path.unlink()


class Bake:
    """A bake in progress. `for progress in bake.steps():` does it; each step takes one evaluation of Blender, or a
    twentieth of a second. stop() ends it after the frame that is being computed, so that it can continue later."""

    running = {}  # by the full name of the object

    def __init__(self, thing, scene, last):
        self.name, self.scene_name = thing.name_full, scene.name  # undo invalidates references to objects
        self.last = last
        self.warnings, self.problem = [], None
        self._run, self._stopped, self.computed = None, False, 0

    @property
    def thing(self):
        found = next((one for one in bpy.data.objects if one.name_full == self.name), None)
        if found is None:
            raise Problem(f"{self.name} was removed during its bake")
        return found

    @property
    def scene(self):
        return bpy.data.scenes[self.scene_name]

    def stop(self):
        self._stopped = True
        if self._run:
            self._run.end_after_frame()

    def steps(self):
        """Yields (what is done, fraction). Raises Problem, after which the frames before it are baked."""
        Bake.running[self.name] = self
        try:
            yield from self._steps()
        finally:
            del Bake.running[self.name]

    def _steps(self):
        listing = reload(self.thing)
        first, start = listing.first, self.thing.rapid.start
        if self.last < start:
            raise Problem(f"{self.name}: the simulation starts at frame {start}, after frame {self.last}; change Start")
        self._refuse_missing(listing)
        inputs = Inputs(folder_of(self.thing) / "inputs")
        yield from self._write_inputs(inputs, first - start, self.scene.frame_end)
        if self._stopped:
            return
        thing, folder = self.thing, folder_of(self.thing)
        folder.mkdir(parents=True, exist_ok=True)
        key, name = key_of(thing, self.scene), text_of(thing)[0]
        if inputs.is_changed or record_of(thing).get("key") != key:
            remove_points(folder)  # no frame of another run is ever shown as one of this one
        table = inputs.table(thing, name)
        if listing.problem:  # which the real inputs may not cause
            listing = reload(thing, table)
            if listing.problem:
                raise listing.problem
            if listing.first != first:
                raise Problem(f"{name}: the scene starts at frame {listing.first}; the inputs were written from {first}")
        given = options(thing, inputs=table)
        file = given.pop("file")
        given["set"].update({f"{node}.fps": frame_rate(self.scene) for node in listing.creates})
        rapid = library.load()
        try:
            self._run = rapid.Run(
                file, [str(folder / "points_{output}.####.npz")], (first, self.last - start + first), **given,
                cache=folder / "cache", cache_every=thing.rapid.every, cache_replace=True, frame=self._hear_frame,
                warning=self.warnings.append)
            self._run.prepare()
            (folder / "bake.json").write_text(json.dumps({
                "key": key, "first": first, "start": start, "fps": frame_rate(self.scene),
                "outputs": [one.name for one in thing.rapid.outputs], "rapid": rapid.version()}), encoding="utf-8")
        except rapid.Error as error:
            raise problem_of(error) from error
        yield from self._compute(rapid, self.last - start + 1)

    def _refuse_missing(self, listing):
        empty = [one for one in self.thing.rapid.inputs if not one.objects]
        if empty and listing.problem:
            raise listing.problem
        if empty:
            file = text_of(self.thing)[0]
            raise Problem(f'{file}:{empty[0].line}: rapid.host "{empty[0].name}": no object is chosen; choose one under '
                          "Inputs", file, empty[0].line)

    def _write_inputs(self, inputs, offset, last):
        """Goes through all frames. One more at each end gives the velocities there. offset: Rapid's number of a frame
        minus Blender's."""
        scene, start = self.scene, self.thing.rapid.start
        here = scene.frame_current, scene.frame_subframe
        frames = range(max(start - 1, -offset), max(last, self.last) + 2)
        try:
            for frame in frames if self.thing.rapid.inputs else ():
                if self._stopped:
                    return
                scene = self.scene
                scene.frame_set(frame)
                inputs.write(self.thing, frame + offset, scene, bpy.context.evaluated_depsgraph_get())
                yield "inputs", (frame - frames[0]) / len(frames)
        finally:
            self.scene.frame_set(here[0], subframe=here[1])
        inputs.finish()

    def _hear_frame(self, *_):
        self.computed += 1

    def _compute(self, rapid, count):
        outcome = []

        def work():
            try:
                outcome.append(self._run.run())
            except rapid.Error as error:
                outcome.append(error)

        worker = threading.Thread(target=work, name="rapid bake")
        worker.start()
        try:
            while worker.is_alive():
                worker.join(0.05)
                yield "frames", self.computed / count
        finally:
            if worker.is_alive():  # the caller has abandoned the bake
                self._run.end_after_frame()
                worker.join()
            self._run.release()
        if isinstance(outcome[0], rapid.Error):
            raise problem_of(outcome[0])


def move_to_saved_file():
    """Moves bakes out of Blender's temporary folder when the .blend has got a name."""
    temporary = pathlib.Path(bpy.app.tempdir) / TEMPORARY
    if not bpy.data.filepath or not temporary.is_dir():
        return
    for folder in list(temporary.iterdir()):
        target = pathlib.Path(bpy.path.abspath("//rapid")) / folder.name
        if not target.exists():
            os.makedirs(target.parent, exist_ok=True)
            shutil.move(folder, target)
