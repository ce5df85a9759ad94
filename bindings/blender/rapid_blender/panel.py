"""The panel in the object properties, the entry of the Add menu, and the preferences, which report the library."""
import bpy

from . import bake, handlers, library, node_groups
from .source import Problem


class RAPID_PT_simulation(bpy.types.Panel):
    bl_label = "Rapid"
    bl_space_type, bl_region_type, bl_context = "PROPERTIES", "WINDOW", "object"

    @classmethod
    def poll(cls, context):
        return context.object is not None and context.object.rapid.is_simulation

    def draw(self, context):
        layout, thing, own = self.layout, context.object, context.object.rapid
        layout.use_property_split = True
        layout.prop(own, "source", expand=True)
        layout.prop(own, "text" if own.source == "TEXT" else "file")
        row = layout.row(align=True)
        if thing.name_full in bake.Bake.running:
            row.label(text="Baking. Esc stops.", icon="SORTTIME")
        else:
            row.operator("rapid.reload", icon="FILE_REFRESH")
            row.operator("rapid.run", icon="PLAY")
            row.operator("rapid.bake", icon="REC")
            row.operator("rapid.free", icon="TRASH")
        self._problems(layout, thing)
        self._section(layout, "Parameters", own.parameters, self._parameter)
        self._section(layout, "Inputs", own.inputs, self._input)
        self._settings(layout.column(), own)
        self._display(layout, thing)

    @staticmethod
    def _section(layout, title, items, draw):
        if len(items):
            box = layout.box()
            box.label(text=title)
            for one in items:
                draw(box, one)

    @staticmethod
    def _parameter(layout, one):
        layout.prop(one, one.FIELDS[one.kind], text=one.name)

    @staticmethod
    def _input(layout, one):
        row = layout.row(align=True)
        row.prop(one, "object" if one.kind == "OBJECT" else "collection", text=one.name)
        row.prop(one, "kind", text="", icon_only=True)

    @staticmethod
    def _settings(column, own):
        for name in ("start", "seed", "threads", "folder", "every"):
            column.prop(own, name)

    @staticmethod
    def _display(layout, thing):
        row = layout.row(align=True)
        row.operator("rapid.show", text="Show Points").form = "POINTS"
        row.operator("rapid.show", text="Show Instances").form = "INSTANCES"
        shown = next((one.node_group.name for one in thing.modifiers if one.type == "NODES" and one.node_group), "")
        if shown == node_groups.INSTANCES and len(thing.data.vertices) > 100_000:
            layout.label(text=f"{len(thing.data.vertices):,} instances are slow; show points", icon="ERROR")

    @staticmethod
    def _problems(layout, thing):
        for known in (handlers.scene_problems, handlers.frame_problems):
            problem = known.get(thing.name_full)
            if problem is None:
                continue
            box = layout.box()
            for place, line in enumerate(_wrapped(str(problem))):
                box.label(text=line, icon="ERROR" if place == 0 else "BLANK1")
            if isinstance(problem, Problem) and problem.line:
                button = box.operator("rapid.open_text", text=f"Open line {problem.line}", icon="TEXT")
                button.path, button.line = problem.file, problem.line


def _wrapped(text, width=60):
    """Splits a message at spaces, because a label has one line."""
    lines = [""]
    for word in text.split():
        if lines[-1] and len(lines[-1]) + len(word) > width:
            lines.append("")
        lines[-1] += (" " if lines[-1] else "") + word
    return lines


class RapidPreferences(bpy.types.AddonPreferences):
    bl_idname = __package__

    def draw(self, _context):
        try:
            rapid = library.load()
            self.layout.label(text=f"Rapid {rapid.version()}: {rapid.__file__}")
        except ImportError as error:
            for line in _wrapped(str(error), 100):
                self.layout.label(text=line, icon="ERROR")


def draw_add_menu(self, _context):
    self.layout.operator("rapid.add", icon="PARTICLES")


CLASSES = (RAPID_PT_simulation, RapidPreferences)
