# SPDX-License-Identifier: GPL-3.0-or-later
"""The look of the reference on a decimated mesh: its normals, and a normal map."""

import sys
import threading
import time
from pathlib import Path

import bpy
import numpy as np
import pytest
from mathutils import Matrix

from addon import native
from addon.appearance import bake_process, baking, normals, other_blender
from addon.mesh.carry import corner_normals
from addon.mesh.mesh_io import column
from addon.proof import kept_warnings
from addon.shared.errors import Refused
from scenes import activate, add_object, sheet, torus

WITHIN = 60  # seconds in which a cancelled job ends on any machine


def ball(smooth=True):
    bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32)
    ob = bpy.context.object
    ob.data.polygons.foreach_set("use_smooth", np.full(len(ob.data.polygons), smooth))
    return ob


def box():
    bpy.ops.mesh.primitive_cube_add()
    ob = bpy.context.object
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.subdivide(number_cuts=10)
    bpy.ops.object.mode_set(mode="OBJECT")
    return ob


def tube():
    """An open cylinder."""
    bpy.ops.mesh.primitive_cylinder_add(vertices=96, end_fill_type="NOTHING")
    return bpy.context.object


def plain(make):
    """Returns an object of make() without UV maps."""
    ob = make()
    while ob.data.uv_layers:
        ob.data.uv_layers.remove(ob.data.uv_layers[0])
    return ob


def decimate(ob, percent=1.0):
    assert bpy.ops.tolvol.decimate(tolerance_percent=percent) == {"FINISHED"}
    return ob


def directions(ob):
    """Returns the direction from the origin to the place of each corner, (corners, 3)."""
    places = column(ob.data.vertices, "co", 3)[column(ob.data.loops, "vertex_index", 1, np.int32)]
    return places / np.linalg.norm(places, axis=1, keepdims=True)


def degrees_apart(one, other):
    return np.degrees(np.arccos(np.clip(np.einsum("ij,ij->i", one, other), -1, 1))).max()


@pytest.mark.parametrize("smooth", (True, False))
def test_the_normals_are_those_of_the_reference(smooth):
    ob = decimate(ball(smooth))
    before = column(ob.data.vertices, "co", 3).tobytes()
    bpy.ops.ed.undo_push(message="before")
    counts = [len(getattr(bpy.data, kind)) for kind in ("meshes", "objects", "scenes")]
    assert len(ob.data.polygons) < 300 and degrees_apart(corner_normals(ob.data), directions(ob)) > 3
    assert bpy.ops.tolvol.shade_by_reference("EXEC_DEFAULT", True) == {"FINISHED"}
    assert degrees_apart(corner_normals(ob.data), directions(ob)) < 1.5
    assert column(ob.data.vertices, "co", 3).tobytes() == before
    assert not column(ob.data.edges, "use_edge_sharp", 1, bool).any()
    assert [len(getattr(bpy.data, kind)) for kind in ("meshes", "objects", "scenes")] == counts
    bpy.ops.ed.undo()
    assert not bpy.context.object.data.has_custom_normals


def test_another_blender_reads_the_same_normals(monkeypatch):
    ob = decimate(ball())
    assert bpy.ops.tolvol.shade_by_reference() == {"FINISHED"}
    before = corner_normals(ob.data)
    ran, run = [], other_blender.run
    monkeypatch.setattr(other_blender, "run", lambda *told: ran.append(told) or run(*told))
    monkeypatch.setattr(normals, "_AT_ONCE", 1000)
    meshes, scenes = len(bpy.data.meshes), len(bpy.data.scenes)
    assert bpy.ops.tolvol.shade_by_reference() == {"FINISHED"} and len(ran) == 1
    assert np.abs(corner_normals(ob.data) - before).max() < 1e-5
    assert (len(bpy.data.meshes), len(bpy.data.scenes)) == (meshes, scenes)


def test_sharp_edges_stay_sharp():
    ob = decimate(box())
    assert bpy.ops.tolvol.shade_by_reference() == {"FINISHED"}
    faces = np.repeat(column(ob.data.polygons, "normal", 3), 3, axis=0)
    assert len(faces) == 36 and np.abs(corner_normals(ob.data) - faces).max() < 1e-3
    assert column(ob.data.edges, "use_edge_sharp", 1, bool).sum() == 12


@pytest.mark.parametrize(
    "matrix",
    (Matrix.Scale(-2, 4), Matrix.Translation((3, 1, 0)) @ Matrix.Rotation(1, 4, "X"), Matrix.Diagonal((1, 1, -1, 1))),
)
def test_the_place_of_the_object_does_not_matter(matrix):
    ob = ball()
    ob.matrix_world = matrix
    bpy.context.view_layer.update()
    decimate(ob)
    assert bpy.ops.tolvol.shade_by_reference() == {"FINISHED"}
    assert degrees_apart(corner_normals(ob.data), directions(ob)) < 1.5


def test_another_object_is_the_reference():
    reference = ball()
    reference.matrix_world = Matrix.Translation((3, 0, 0)) @ Matrix.Scale(2, 4) @ Matrix.Rotation(1, 4, "X")
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3, radius=2, location=(3, 0, 0))
    ob = bpy.context.object
    ob.tolvol.reference_kind, ob.tolvol.reference_object = "OBJECT", reference
    bpy.ops.tolvol.set_reference()
    assert bpy.ops.tolvol.shade_by_reference() == {"FINISHED"}
    assert degrees_apart(corner_normals(ob.data), directions(ob)) < 2


def test_why_it_is_not_possible():
    ob = ball()
    for operator in (bpy.ops.tolvol.shade_by_reference, bpy.ops.tolvol.bake_normals):
        with pytest.raises(RuntimeError, match="Set the reference first"):
            operator()
    bpy.ops.tolvol.set_reference()
    other = bpy.data.objects.new("other", ob.data)
    for operator in (bpy.ops.tolvol.shade_by_reference, bpy.ops.tolvol.bake_normals):
        with pytest.raises(RuntimeError, match="2 users share the mesh .*: Object > Relations"):
            operator()
    bpy.data.objects.remove(other)
    ob.scale.x = 0
    bpy.context.view_layer.update()
    for operator in (bpy.ops.tolvol.shade_by_reference, bpy.ops.tolvol.bake_normals):
        with pytest.raises(RuntimeError, match="no extent along an axis: Object > Clear > Scale"):
            operator()


def test_a_temporary_folder_that_cannot_be_written_is_named_with_a_remedy(monkeypatch):
    decimate(ball())
    folder = Path(bpy.app.tempdir)
    away = folder.rename(f"{folder}.away")
    try:
        assert bpy.ops.tolvol.shade_by_reference() == {"FINISHED"}, "no other Blender reads the normals of few corners"
        monkeypatch.setattr(normals, "_AT_ONCE", 0)
        for operator in (bpy.ops.tolvol.shade_by_reference, bpy.ops.tolvol.bake_normals):
            with pytest.raises(
                RuntimeError, match=f"temporary folder {folder}/ .*: make room there, or choose another"
            ):
                operator()
    finally:
        away.rename(folder)
    # A full disk is noticed only when the meshes are written.
    objects = len(bpy.data.objects)
    with pytest.raises(Refused, match="make room there"):
        other_blender.write(folder / "missing", [bpy.context.object.data.copy()])
    assert len(bpy.data.objects) == objects


@pytest.fixture
def baked(monkeypatch):
    """The outcomes of the bakes."""
    outcomes, run = [], baking.Task.run
    monkeypatch.setattr(baking.Task, "run", lambda *arguments: outcomes.append(run(*arguments)) or outcomes[-1])
    return outcomes


def bake(**options):
    return bpy.ops.tolvol.bake_normals(**{"image_size": 256} | options)


def side_by_side():
    """Closed and open, smooth and rough surfaces, and one with sharp edges, in one mesh, which are baked in one go."""
    for i, make in enumerate((ball, torus, box, tube, lambda: torus(noise=0.01))):
        make().location.x = 4 * i
    bpy.ops.object.select_all(action="SELECT")
    bpy.ops.object.join()
    return bpy.context.object


@pytest.mark.parametrize(("make", "percent", "size"), [(sheet, 1, 256), (side_by_side, 0.15, 512)])
def test_no_ray_misses(make, percent, size, baked):
    decimate(plain(make), percent)
    assert bake(image_size=size) == {"FINISHED"}
    assert baked[0].missed == 0 and baked[0].covered > 0.2 * size**2


def pixels(image):
    values = np.empty(4 * image.size[0] * image.size[1], np.float32)
    image.pixels.foreach_get(values)
    return values.reshape(-1, 4)[:, :3]


def test_the_scene_stays_as_it_is_and_one_undo_step_takes_all_back():
    other = sheet("other")
    ob = decimate(plain(torus))
    shared = bpy.data.materials.new("steel")
    shared.use_nodes = True
    nodes = len(shared.node_tree.nodes)
    for each in (ob, other):
        each.data.materials.append(shared)
    other.select_set(True)
    other.hide_render = True
    bpy.context.scene.render.engine = "BLENDER_WORKBENCH"
    bpy.ops.ed.undo_push(message="before")

    def state():
        kinds = ("meshes", "objects", "scenes")
        selected = sorted(each.name for each in bpy.context.selected_objects)
        counts = [len(getattr(bpy.data, kind)) for kind in kinds]
        return bpy.context.scene.render.engine, selected, bpy.context.object.name, counts

    before = state()
    assert bpy.ops.tolvol.bake_normals("EXEC_DEFAULT", True, image_size=128) == {"FINISHED"}
    assert state() == before
    image = bpy.data.images["torus normals"]
    assert image.packed_file and tuple(image.size) == (128, 128) and image.colorspace_settings.name == "Non-Color"
    assert np.ptp(pixels(image), axis=0)[:2].min() > 0.02
    material = ob.data.materials[0]
    assert material != shared and other.data.materials[0] == shared and len(shared.node_tree.nodes) == nodes
    link = material.node_tree.nodes["Principled BSDF"].inputs["Normal"].links[0]
    assert link.from_node.inputs["Color"].links[0].from_node.image == image
    assert link.from_node.uv_map == ob.data.uv_layers[0].name
    bpy.ops.ed.undo()
    ob = bpy.data.objects["torus"]
    assert not ob.data.uv_layers and not ob.data.has_custom_normals and not bpy.data.images
    assert ob.data.materials[0].name == "steel"


def test_uv_maps_are_kept_and_a_second_bake_replaces_the_first():
    ob = decimate(ball())
    uvs = column(ob.data.uv_layers[0].data, "uv", 2).tobytes()
    assert bake(image_size=64) == {"FINISHED"}
    count = len(ob.data.materials[0].node_tree.nodes)
    assert bake(image_size=128, shade=False) == {"FINISHED"}
    assert len(ob.data.uv_layers) == 1 and column(ob.data.uv_layers[0].data, "uv", 2).tobytes() == uvs
    assert len(ob.data.materials) == len(bpy.data.materials) == 1
    assert len(ob.data.materials[0].node_tree.nodes) == count
    assert [tuple(image.size) for image in bpy.data.images] == [(128, 128)]
    assert (ob.tolvol.bake.image_size, ob.tolvol.bake.shade) == (128, False)


def test_the_warnings_of_a_bake_stay_until_the_next_operation():
    ob = ball()
    material = bpy.data.materials.new("steel")
    material.use_nodes = True
    nodes = material.node_tree.nodes
    normal = nodes.new("ShaderNodeNormalMap")
    material.node_tree.links.new(normal.outputs["Normal"], nodes["Principled BSDF"].inputs["Normal"])
    ob.data.materials.append(material)
    decimate(ob)
    assert bake(image_size=64) == {"FINISHED"}
    assert kept_warnings.of(ob)[0] == ["The normal map of the material steel was replaced in the copy for Sphere"]
    decimate(ob, 2)
    assert kept_warnings.of(ob)[0] == []


def test_an_image_of_the_user_with_the_same_name_stays():
    decimate(ball())
    mine = bpy.data.images.new("Sphere normals", 8, 8)  # Nothing uses it.
    bake()
    bake()
    assert bpy.data.images["Sphere normals"] == mine and tuple(mine.size) == (8, 8)
    assert [tuple(image.size) for image in bpy.data.images if image != mine] == [(256, 256)]


def rendered(ob):
    """Returns a small picture of `ob` alone, by Cycles."""
    scene = bpy.context.scene
    for each in scene.objects:
        each.hide_render = each.type == "MESH" and each != ob
    scene.render.engine, scene.render.resolution_x, scene.render.resolution_y = "CYCLES", 96, 96
    scene.render.resolution_percentage = 100
    scene.cycles.samples, scene.cycles.use_denoising = 16, False
    path = bpy.app.tempdir + "look.png"
    scene.render.filepath = path
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(path)
    found = pixels(image).copy()
    bpy.data.images.remove(image)
    return found


def test_a_baked_mesh_looks_like_the_original():
    """A ball with grooves that are as deep as the tolerance."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=96, ring_count=96)
    ob = bpy.context.object
    places = column(ob.data.vertices, "co", 3)
    places *= 1 + 0.006 * np.sin(40 * places[:, 2:])
    # Blender makes the faces of a ball in another order in each run, and the decimation would be another one.
    faces = []
    for face in ob.data.polygons:
        corners = list(face.vertices)
        first = corners.index(min(corners))
        faces.append(corners[first:] + corners[:first])
    add_object("original", places, sorted(faces))
    original = bpy.context.object
    bpy.data.objects.remove(ob)
    original.data.polygons.foreach_set("use_smooth", np.ones(len(original.data.polygons), bool))
    matt = bpy.data.materials.new("matt")
    matt.use_nodes = True
    matt.node_tree.nodes["Principled BSDF"].inputs["Roughness"].default_value = 1
    matt.node_tree.nodes["Principled BSDF"].inputs[
        "Specular" if bpy.app.version < (4, 0) else "Specular IOR Level"
    ].default_value = 0
    original.data.materials.append(matt)
    ob = original.copy()
    ob.data = original.data.copy()
    bpy.context.collection.objects.link(ob)
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    light = bpy.data.objects.new("light", bpy.data.lights.new("light", "SUN"))
    camera.location, light.rotation_euler = (0, 0, 6), (0.9, 0, 0.4)
    camera.data.lens = 80
    light.data.energy = 3
    for each in (camera, light):
        bpy.context.collection.objects.link(each)
    bpy.context.scene.camera = camera
    activate(ob)
    decimate(ob, 0.6)
    wanted, before = rendered(original), rendered(ob)
    # Outlines and shadows are those of the shape in any case.
    x, y = np.meshgrid(np.arange(96) - 47.5, np.arange(96) - 47.5)
    compared = (np.hypot(x, y) < 24).ravel() & (wanted[:, 0] > 0.6)
    assert compared.sum() > 900

    def apart(picture):
        return np.abs(picture - wanted)[compared].mean()

    for shade in (True, False):
        assert bake(image_size=512, shade=shade) == {"FINISHED"}
        after = apart(rendered(ob))
        assert after < 0.4 * apart(before), (shade, after, apart(before))


def test_a_uv_map_without_area_is_named():
    ob = decimate(plain(torus))
    ob.data.uv_layers.new(name="flat").data.foreach_set("uv", np.zeros(2 * len(ob.data.loops), np.float32))
    with pytest.raises(RuntimeError, match="The UV map of torus has no area: unwrap it"):
        bake()
    assert not bpy.data.images and not ob.data.has_custom_normals


def test_what_the_other_blender_cannot_do_is_said(monkeypatch):
    decimate(torus())
    answer = "import json, sys; open(sys.argv[-1] + '/result.json', 'w').write(json.dumps({'error': 'no Cycles'}))"
    for code, message in ((answer, "has no Cycles, which bakes: install"), ("exit(3)", "ended without a result")):
        monkeypatch.setattr(
            other_blender, "command", lambda _, folder, code=code: [sys.executable, "-c", code, str(folder)]
        )
        with pytest.raises(RuntimeError, match=message):
            bake()
    assert not bpy.data.images


def test_the_other_blender_says_that_it_has_no_cycles(tmp_path, monkeypatch):
    (tmp_path / "task.json").write_text("{}")
    monkeypatch.setattr(bake_process, "bpy", type("bpy", (), {"ops": bpy.ops, "context": _Without}))
    assert bake_process.main(tmp_path) == {"error": "no Cycles"}


class _Render:
    def __setattr__(self, name, value):
        raise TypeError(f"enum {value!r} not found")


class _Without:
    scene = type("scene", (), {"render": _Render()})


def test_a_cancel_ends_the_other_blender(tmp_path, monkeypatch):
    ob = decimate(torus())
    monkeypatch.setattr(other_blender, "command", lambda *_: ["sleep", "infinity"])
    started, popen = [], other_blender.subprocess.Popen
    monkeypatch.setattr(
        other_blender.subprocess, "Popen", lambda *a, **k: started.append(popen(*a, **k)) or started[-1]
    )
    task, progress = baking.Task(ob, None, 0.01, 64, 0, tmp_path), native.module.Progress()
    failed = []

    def run():
        try:
            task.run(progress)
        except native.module.Cancelled:
            failed.append(True)

    thread = threading.Thread(target=run)
    thread.start()
    while not started:
        time.sleep(0.01)
    progress.cancel()
    thread.join(WITHIN)
    if not (ended := started[0].poll() is not None):
        started[0].kill()
    assert failed and ended
