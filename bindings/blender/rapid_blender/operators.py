"""Operators of the panel. All of them also work without a window."""
import bpy
from bpy.props import IntProperty, StringProperty

from . import handlers, node_groups, points, source
from .bake import Bake, free
from .source import Problem

TEMPLATE = '''local rapid = require "rapid"

local rate = rapid.param("rate", 2000, "points born per second [0, 100000]")
local color = rapid.param("color", {0.2, 0.5, 1}, "of the points [color]")

-- Choose objects of Blender for these names under Inputs. Lengths are in metres, and y is up.
local emitter = rapid.host "emitter"

return rapid.create {}
  :emit    { source = emitter, rate = rate, life = {2, 4}, attributes = { Cd = color, pscale = 0.02 } }
  :gravity {}
  :collide { shape = rapid.shape.plane { normal = {0, 1, 0} }, bounce = 0.4, friction = 0.2 }
  :solve   {}
'''


def _report(operator, thing, problem):
    handlers.scene_problems[thing.name_full] = problem
    operator.report({"ERROR"}, str(problem))


def _reload(operator, thing):
    """Returns true if the scene has no mistake."""
    handlers.scene_problems.pop(thing.name_full, None)
    try:
        listing = source.reload(thing)
        if listing.problem:
            raise listing.problem
    except (Problem, ImportError) as problem:
        _report(operator, thing, problem)
        return False
    for one in thing.rapid.outputs:
        if one.object and not one.object.modifiers:
            node_groups.show(one.object, node_groups.POINTS)
    handlers.refill()
    return True


class Simulation:
    """The common base of operators on a simulation: the active object, or the one with the given name."""
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context):
        return context.object is not None and context.object.rapid.is_simulation


class RAPID_OT_add(bpy.types.Operator):
    """Add an object whose points are simulated by a scene of Rapid"""
    bl_idname, bl_label, bl_options = "rapid.add", "Rapid Simulation", {"REGISTER", "UNDO"}

    def execute(self, context):
        text = bpy.data.texts.new("rapid.lua")
        text.write(TEMPLATE)
        thing = bpy.data.objects.new("Rapid", bpy.data.meshes.new("Rapid"))
        context.collection.objects.link(thing)
        thing.rapid.is_simulation, thing.rapid.text = True, text
        thing.rapid.start = context.scene.frame_start
        context.scene.render.use_lock_interface = True  # handlers write meshes while a frame is rendered
        node_groups.show(thing, node_groups.POINTS)
        for one in context.selected_objects:
            one.select_set(False)
        thing.select_set(True)
        context.view_layer.objects.active = thing
        _reload(self, thing)
        return {"FINISHED"}


class RAPID_OT_reload(Simulation, bpy.types.Operator):
    """Read the scene again: its parameters, inputs and outputs"""
    bl_idname, bl_label = "rapid.reload", "Reload"

    def execute(self, context):
        return {"FINISHED"} if _reload(self, context.object) else {"CANCELLED"}


class Baking(Simulation):
    """A bake with a window is modal; without one it blocks."""

    last: IntProperty(name="Last frame", default=-1, description="-1: the end of Blender's scene")

    def invoke(self, context, _event):
        if not self._begin(context):
            return {"CANCELLED"}
        self._timer = context.window_manager.event_timer_add(0.05, window=context.window)
        context.window_manager.modal_handler_add(self)
        context.window_manager.progress_begin(0, 1)
        return {"RUNNING_MODAL"}

    def execute(self, context):
        if not self._begin(context):
            return {"CANCELLED"}
        while (result := self._step(context)) is None:
            pass
        return result

    def _begin(self, context):
        thing = context.object
        if thing.name_full in Bake.running:
            self.report({"ERROR"}, f"{thing.name} is being baked already")
            return False
        handlers.scene_problems.pop(thing.name_full, None)
        self._bake = Bake(thing, context.scene, context.scene.frame_end if self.last < 0 else self.last)
        self._steps = self._bake.steps()
        return True

    def modal(self, context, event):
        if event.type == "ESC":
            self._bake.stop()
        if event.type != "TIMER":
            return {"RUNNING_MODAL"} if event.type == "ESC" else {"PASS_THROUGH"}
        result = self._step(context)
        return result or {"RUNNING_MODAL"}

    def _step(self, context):
        """Returns None while the bake goes on."""
        handlers.is_paused = True
        try:
            what, fraction = next(self._steps)
            if not bpy.app.background:
                context.window_manager.progress_update(fraction)
                context.workspace.status_text_set(f"Rapid: {what}, {100 * fraction:.0f} %    Esc: stop")
            return None
        except StopIteration:
            result = {"FINISHED"}
        except (Problem, ImportError) as problem:
            _report(self, bpy.data.objects.get(self._bake.name) or context.object, problem)
            result = {"CANCELLED"}
        finally:
            handlers.is_paused = False
        for warning in self._bake.warnings:
            self.report({"WARNING"}, warning)
        if getattr(self, "_timer", None):
            context.window_manager.event_timer_remove(self._timer)
            context.window_manager.progress_end()
            context.workspace.status_text_set(None)
        handlers.refill()
        return result

    def cancel(self, _context):
        self._bake.stop()
        self._steps.close()


class RAPID_OT_bake(Baking, bpy.types.Operator):
    """Simulate and store all frames. Esc stops after the current frame; Bake then continues from there"""
    bl_idname, bl_label = "rapid.bake", "Bake"


class RAPID_OT_run(Baking, bpy.types.Operator):
    """Simulate and store the frames up to the current one"""
    bl_idname, bl_label = "rapid.run", "Run"

    def _begin(self, context):
        self.last = context.scene.frame_current
        return super()._begin(context)


class RAPID_OT_free(Simulation, bpy.types.Operator):
    """Remove the stored frames"""
    bl_idname, bl_label = "rapid.free", "Free"

    def execute(self, context):
        thing = context.object
        if thing.name_full in Bake.running:
            self.report({"ERROR"}, f"{thing.name} is being baked; stop the bake first")
            return {"CANCELLED"}
        free(thing)
        for one in thing.rapid.outputs:
            if one.object:
                points.empty(one.object.data)
        handlers.refill()
        return {"FINISHED"}


class RAPID_OT_show(Simulation, bpy.types.Operator):
    """Show the points as a point cloud, or as copies of an object that turn with the attribute rotation"""
    bl_idname, bl_label, bl_options = "rapid.show", "Show as", {"REGISTER", "UNDO"}

    form: bpy.props.EnumProperty(items=[("POINTS", "Points", ""), ("INSTANCES", "Instances", "")])

    def execute(self, context):
        node_groups.show(context.object, getattr(node_groups, self.form))
        return {"FINISHED"}


class RAPID_OT_open_text(bpy.types.Operator):
    """Show the scene in a text editor, at a line"""
    bl_idname, bl_label = "rapid.open_text", "Open"

    path: StringProperty()
    line: IntProperty()

    def execute(self, context):
        name = bpy.path.basename(self.path)
        text = next((one for one in bpy.data.texts if one.filepath and bpy.path.abspath(one.filepath) == self.path),
                    None) or bpy.data.texts.get(name)
        if text is None:
            try:
                text = bpy.data.texts.load(self.path)
            except RuntimeError as error:
                self.report({"ERROR"}, str(error))
                return {"CANCELLED"}
        if self.line > 0:
            text.select_set(self.line - 1, 0, self.line - 1, -1)
        if context.screen:
            areas = list(context.screen.areas)
            area = next((one for one in areas if one.type == "TEXT_EDITOR"), None) \
                or max((one for one in areas if one.type != "PROPERTIES"), key=lambda one: one.width * one.height)
            area.type = "TEXT_EDITOR"
            area.spaces.active.text = text
            area.spaces.active.top = max(0, self.line - 10)
        return {"FINISHED"}


CLASSES = (RAPID_OT_add, RAPID_OT_reload, RAPID_OT_bake, RAPID_OT_run, RAPID_OT_free, RAPID_OT_show, RAPID_OT_open_text)
