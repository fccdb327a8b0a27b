# SPDX-License-Identifier: GPL-3.0-or-later
"""Gives a mesh the look of its reference: normals, and a normal map."""

import bpy

from .. import preferences
from ..appearance import baking, materials, normals, other_blender
from ..job import WRITE, JobOperator
from ..operation_settings import bake_settings, threads_setting
from ..proof import kept_warnings
from ..reference import snapshots, tolerances
from ..shared.errors import Refused
from . import settings as shared
from .blocked import allowed, check_blocked, mesh_blocked

_READING = "Reading the normals"

# A custom property of an image that was baked for an object: the name of the object.
_NORMALS_OF = "tolvol_normals_of"


def appearance_blocked(ob):
    """Why the mesh of `ob` cannot get the look of its reference now, or None."""
    if reason := mesh_blocked(ob) or check_blocked(ob):
        return reason
    if any(modifier.type == "MULTIRES" for modifier in ob.modifiers):
        return "Apply the Multiresolution modifier first"
    return None


class TOLVOL_OT_shade_by_reference(JobOperator, bpy.types.Operator):
    """Shade the mesh smooth with the normals of the reference at the nearest points, as custom normals. Edges where the \
normals of the two sides differ by more than 20 degrees are marked as sharp. The shape stays as it is"""

    bl_idname = "tolvol.shade_by_reference"
    bl_label = "Shade Smooth by the Reference's Normals"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return allowed(cls, appearance_blocked(context.active_object))

    def steps(self, context):
        context.view_layer.update()
        # The label has no room in the panel.
        self.part, self.doing = "Shade by Reference", _READING
        shading = yield from normals.shading(self.ob)
        yield WRITE
        ob = self.ob
        shading.write(ob.data)
        sharp = int(shading.sharp.sum())
        self.say({"INFO"}, f"{ob.name} has the normals of its reference, {sharp:,} edges are sharp")


class TOLVOL_OT_bake_normals(JobOperator, bpy.types.Operator):
    """Bake the normals of the reference into an image for this mesh, and show it in the materials. Cycles bakes within the \
tolerance, in a second Blender without a window. Without a UV map, Smart UV Project makes one"""

    bl_idname = "tolvol.bake_normals"
    bl_label = "Bake Normal Map"
    bl_options = {"REGISTER", "UNDO"}

    __annotations__ = bake_settings({"SKIP_SAVE"})
    threads: threads_setting()

    @classmethod
    def poll(cls, context):
        return allowed(cls, appearance_blocked(context.active_object))

    def draw(self, _context):
        self.layout.use_property_split = True
        self.layout.prop(self, "image_size")
        self.layout.prop(self, "shade")

    def steps(self, context):
        context.view_layer.update()
        ob = self.ob
        shared.take(self, ob.tolvol.bake, bake_settings())
        reference = snapshots.reference_of(ob)
        if not reference.size() > 0:
            raise Refused(f"The reference of {ob.name} has no size: replace it")
        tolerance = tolerances.required(ob, reference.size())
        threads = self.threads or preferences.threads(context) or 0
        self.doing = _READING
        shading = (yield from normals.shading(ob)) if self.shade else None
        self.doing = "Baking the normals"
        with other_blender.temporary_folder("bake-") as folder:
            task = baking.Task(ob, shading, tolerance, self.image_size, threads, folder)
            baked = yield task.run
            yield WRITE
            self._write(self.ob, shading, baked)

    def _write(self, ob, shading, baked):
        mesh = ob.data
        before = [image for image in bpy.data.images if image.get(_NORMALS_OF) == ob.name and image.library is None]
        image = bpy.data.images.load(str(baked.path))
        image[_NORMALS_OF] = ob.name
        image.colorspace_settings.name = "Non-Color"
        image.pack()
        image.filepath = ""
        if shading is not None:
            shading.write(mesh)
        made = baked.uvs is not None
        if made:
            mesh.uv_layers.new().data.foreach_set("uv", baked.uvs)
        uv_map = mesh.uv_layers.active.name
        warnings = materials.show(ob, image, uv_map)
        for earlier in before:
            if earlier.users == 0:
                bpy.data.images.remove(earlier)
        image.name = f"{ob.name} normals"  # If another image has the name, Blender adds a number.
        shared.give(self, ob.tolvol.bake, bake_settings())
        if baked.missed:
            share = 100 * baked.missed / baked.covered
            warnings.append(
                f"{share:.2g} % of the pixels have no point of the reference in front of them, as at open borders: there the "
                "normal map changes nothing"
            )
        kept_warnings.keep(ob, warnings)
        for warning in warnings:
            self.say({"WARNING"}, warning)
        uvs = f"Smart UV Project made the UV map {uv_map}" if made else f"by the UV map {uv_map}"
        size = image.size[0]
        self.say({"INFO"}, f"{image.name}: {size} x {size} pixels, packed into the file; {uvs}")
