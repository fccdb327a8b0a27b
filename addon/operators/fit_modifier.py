# SPDX-License-Identifier: GPL-3.0-or-later
"""Applies a modifier that changes the faces with the setting that leaves the fewest triangles within the tolerance."""

import bpy
import numpy as np
from bpy.props import FloatProperty, StringProperty

from .. import native, preferences
from ..mesh import mesh_io
from ..mesh.evaluation import Evaluation
from ..operation_settings import modifier_settings, threads_setting
from ..proof import kept_warnings, last_run
from ..properties import automatic_placement
from ..reference import measurements, snapshots, tolerances
from ..shared.decimation import Task
from ..shared.errors import NotProved, Refused, WouldCross
from ..shared.proof import measure, report, solidity
from ..shared.proof.certify import certify
from ..shared.proof.verdict import Verdict
from ..shared.surface import Surface
from . import decimation, fit
from . import settings as shared
from .mesh_and_reference import mesh_and_reference
from .modifiers import ModifierOperator


class TOLVOL_OT_fit_modifier(ModifierOperator, bpy.types.Operator):
    """Find the setting of a Decimate, Remesh or Weld modifier that leaves the fewest triangles within the tolerance both \
ways, and apply the modifier to the base mesh. An object without a reference gets one first, as by Set Reference"""

    bl_idname = "tolvol.fit_modifier"
    bl_label = "Fit Modifier to Tolerance"
    bl_options = {"REGISTER", "UNDO"}

    __annotations__ = modifier_settings({"SKIP_SAVE"})
    modifier: StringProperty(
        name="Modifier",
        description="The name of the modifier. If none is given, the first modifier that can be fitted is used",
        options={"SKIP_SAVE"},
    )
    value: FloatProperty(
        name="Value",
        description="The ratio, voxel size or distance of the modifier. If it is 0, the value is searched",
        min=0.0,
        precision=5,
        options={"SKIP_SAVE"},
    )
    threads: threads_setting()
    _found = ()  # (number of triangles, value) of each value at which no sample is beyond the tolerance

    def draw(self, _context):
        self.layout.use_property_split = True
        self.layout.prop(self, "value")
        self.layout.prop(self, "result")

    def steps(self, context):
        self._found = []
        context.view_layer.update()
        ob, modifier = self.ob, self.chosen(fitted=True)
        if self.result == "SHAPE_KEY":
            raise Refused(f"{modifier.name} changes the faces of {ob.name}: choose Replace or New Object")
        surface, reference = yield from mesh_and_reference(ob)
        name, trial = modifier.name, _Trial(ob, surface, reference, self.threads or preferences.threads(context))
        # It comes before the search, so that Esc in the search does not leave it out.
        self._plain = yield from self._of_decimate(context, trial)
        parameter = trial.parameter(modifier, self._plain)
        with Evaluation(ob, name) as evaluation:
            # Adjust Last Operation passes the value that was found, or one that the user typed: no search is needed.
            if self.value:
                found = [(0, self.value)]
            else:
                found = yield from self._search(evaluation, parameter, trial, parameter.first, parameter.near)
            proved = yield from self._proved(evaluation, parameter, trial, found)
            if proved is None:
                yield from self._refuse(name, parameter, trial)
            self.value, mesh, certified = proved
        shared.give(self, self.ob.tolvol.modifiers, modifier_settings())
        warnings, before = _crossing_warnings(name, certified["solidity"]), len(trial.surface.arrays.triangles)
        if trial.left > before:
            warnings.append(
                f"{name} leaves {trial.left:,} triangles, more than the {before:,} that there were: undo it unless its new "
                "faces are wanted"
            )
        if self._plain is not None and self._plain < trial.left:
            warnings.append(
                f"The button Decimate leaves fewer triangles within this tolerance: {self._plain:,}, and the modifier {name} "
                f"{trial.left:,}"
            )
        self._write(context, trial, mesh, certified, warnings)
        for warning in warnings:
            self.say({"WARNING"}, warning)
        self.say({"INFO"}, f"{name}: {parameter.label} {self.value:.4g}, {trial.line(certified)}")

    def improving(self):
        return bool(self._found) and not self.progress.finishing

    def _search(self, evaluation, parameter, trial, first, near=None):
        """Returns (number of triangles, value) of values from `first` on at which no sample is beyond the tolerance and no more
        faces cross than may, the fewest triangles first. A value at which the modifier removes no triangle is left out unless
        it _counts()."""
        self._found = []
        name, triangles = evaluation.modifier.name, len(trial.surface.arrays.triangles)
        most, tried = fit.most_values(triangles), 0
        search, deviation = fit.search(first, parameter.last, most, near), None
        while not self.progress.finishing:
            try:
                value = search.send(deviation)
            except StopIteration:
                break
            self.part, self.doing = f"Fitting {name}", f"{parameter.label} {value:.4g}"
            self.share, tried = min(tried / most, 1), tried + 1
            setattr(evaluation.modifier, parameter.name, value)
            arrays = mesh_io.read_mesh(evaluation.mesh())
            deviation = yield trial.judged(arrays)
            if deviation > 1:
                continue
            if self._counts(evaluation, trial, len(arrays.triangles)):
                self._found.append((len(arrays.triangles), value))
                fewest = min(self._found)[0]
                than = f", {triangles:,} before" if fewest > triangles else ""
                self.count = f"{fewest:,} triangles, unproved{than}"
        found = sorted(self._found)
        if self.progress.finishing:
            return found
        # If none of these is proved, values that are nearer to them than the first ones of the search are tried.
        return [pair for pair in found if fit.close(pair[1], found[0][1])]

    def _refuse(self, name, parameter, trial):
        """Raises Refused, because no value leaves fewer triangles within the tolerance."""
        ob, before = self.ob, len(trial.surface.arrays.triangles)
        why, remedy = "", "Take a larger tolerance"
        self.part, self.doing, self.share, self.count = f"Fitting {name}", "Comparing the quads", 0.0, ""
        if (yield trial.measured(mesh_io.both_triangulations(ob.data, trial.surface.arrays))) > 1:
            why = ": the modifier may cut bent quads along the other diagonal, which takes them beyond the tolerance"
        if self._plain is not None and self._plain < before:
            remedy += f", or press Decimate, which leaves {self._plain:,}"
        if trial.crossed:
            remedy += ". At a value within the tolerance faces would cross, which Crossings can allow"
        raise Refused(
            f"No {parameter.label} of {name} leaves fewer than the {before:,} triangles of {ob.name} within the "
            f"tolerance{why}. {remedy}"
        )

    def _proved(self, evaluation, parameter, trial, found):
        """Returns (value, mesh, the result of certified()) for the first of the values whose mesh is proved to be within
        and, where crossings are kept out, has no more of them than before.

        Samples may miss the largest deviation of all values that a search has found. A second search then begins at the one of
        them with the most triangles, and measures exactly. It returns None if no value is proved at which the modifier, other
        than Remesh, removes a triangle.
        found: (number of triangles, or 0 if it is not known, value) of each, the one with the fewest triangles first.
        """
        while found:
            for triangles, value in found:
                try:
                    proved = yield from self._proof(evaluation, parameter, trial, value, triangles)
                except (NotProved, WouldCross):
                    if self.value:
                        raise
                    continue
                if self.value or self._counts(evaluation, trial, trial.left):
                    return proved
                bpy.data.meshes.remove(proved[1])
            if trial.exact:
                break
            trial.exact = True
            found = yield from self._search(evaluation, parameter, trial, found[-1][1])
        name, ob = evaluation.modifier.name, self.ob.name
        if self.progress.finishing:
            raise Refused(
                f"The search was ended, and no {parameter.label} of {name} was proved to keep {ob} within the tolerance both "
                "ways. Nothing was changed: take a larger tolerance"
            )
        if evaluation.modifier.type == "REMESH":
            raise Refused(
                f"No {parameter.label} of {name} keeps {ob} within the tolerance both ways: a remeshed surface is closed and "
                "has rounded edges. Take a larger tolerance, or press Decimate"
            )
        return None

    def _proof(self, evaluation, parameter, trial, value, triangles=0):
        """Returns (value, mesh, the result of certified()) for a value. It raises what certified() raises."""
        self.part, self.doing = f"Proving {evaluation.modifier.name}", f"{parameter.label} {value:.4g}"
        self.share, self.count = 0.0, f"{triangles:,} triangles" if triangles else ""
        setattr(evaluation.modifier, parameter.name, value)
        mesh = evaluation.new_mesh()
        try:
            return value, mesh, (yield trial.certified(mesh_io.read_mesh(mesh)))
        except BaseException as error:
            bpy.data.meshes.remove(mesh)
            if isinstance(error, WouldCross):
                raise WouldCross(f"At the {self.doing} of {evaluation.modifier.name}, {error}") from None
            raise

    @staticmethod
    def _counts(evaluation, trial, triangles):
        """Whether a value that leaves so many triangles is wanted. Remesh makes new faces, which may be wanted even if they are
        more than before."""
        return triangles < len(trial.surface.arrays.triangles) or evaluation.modifier.type == "REMESH"

    def _of_decimate(self, context, trial):
        """Returns how many triangles Decimate would leave with its default settings, or None if it would be refused."""
        self.part, self.doing, self.share = "", "Comparing with Decimate", 0.0
        settings = self.ob.tolvol
        options = decimation.options(settings, automatic_placement(self.ob.data), trial.threads)
        options |= {
            "two_sided": True,
            "effort": "fast",
            "target_triangles": None,
            "max_seconds": None,
            "outside": "error",
        }
        task = Task(self.ob.name, trial.surface, trial.reference, trial.tolerance, options)
        task.uvs = mesh_io.corner_uvs(self.ob.data)
        try:
            return (yield task.count)
        except native.module.Cancelled:
            raise
        except native.module.TolvolError:
            # The mesh may be beyond the tolerance, so that Decimate cannot begin with it.
            return None

    def _write(self, context, trial, mesh, certified, warnings):
        ob = self.target(context)
        if ob.tolvol.snapshot is None:
            snapshots.set_reference(ob, trial.reference)
        before = ob.data
        name, mesh.use_fake_user = before.name, before.use_fake_user
        for key, value in before.items():
            mesh[key] = value
        ob.data = mesh
        bpy.data.meshes.remove(before)
        mesh.name = name
        kept_warnings.keep(ob, warnings)
        measurements.remember(ob, snapshots.surface_of(ob), certified, trial.tolerance)
        last_run.keep(ob, {"operation": "fit_modifier", "solidity": certified["solidity"]})


def _crossing_warnings(name, compared):
    """Returns a list with a warning if more pairs of faces cross than before: Blender's modifiers do not look for them."""
    before, after = (compared[when]["crossing_pairs"] for when in ("before", "after"))
    if after <= before:
        return []
    pairs = solidity.pair_count(after)
    return [f"{name} makes faces cross: the number of crossing pairs of faces is {pairs}, and was {before:,} before"]


# The number of vertices of the reference that are looked at first.
_FEW = 4000


def _samples(vertices, triangles):
    """Returns points of a surface: the corners, the centre and the middles of the edges of each triangle."""
    corners = vertices[triangles]
    middles = (corners + corners[:, [1, 2, 0]]) / 2
    return np.concatenate([vertices[np.unique(triangles)], corners.mean(1), middles.reshape(-1, 3)])


class _Trial:
    """Compares meshes of one object with its reference. measured(), judged() and certified() return work for the thread.

    exact: whether judged() decides like certified(), and not by samples alone.
    left: the number of triangles of the last mesh that was proved to be within the tolerance.
    crossed: whether a mesh that no sample proves to be beyond was refused because more faces would cross.
    """

    def __init__(self, ob, surface, reference, threads):
        self.surface, self.reference = surface, reference
        self.size = self.reference.size()
        self.tolerance = tolerances.required(ob, self.size)
        self.threads = threads
        self._pair = self.reference.world(), self.reference.arrays.triangles
        self.exact, self.left, self.crossed = False, 0, False
        self._keeps_crossings_out = ob.tolvol.crossings == "KEEP_OUT"

    def parameter(self, modifier, plain):
        arrays = self.surface.arrays
        used = arrays.vertices[np.unique(arrays.triangles)]
        size = float(np.linalg.norm(used.max(0) - used.min(0)))
        return fit.parameter(modifier, len(arrays.triangles), size, self.tolerance * size / self.surface.size(), plain)

    def measured(self, arrays):
        """Returns work that gives the larger of the deviations both ways, in tolerances. It is above 1 if a sample proves that
        the mesh is beyond the tolerance. If it is at most 1, certified() decides.
        """

        def work(progress):
            if not len(arrays.triangles):
                return np.inf
            pair = Surface(arrays, self.surface.matrix).world(), arrays.triangles
            vertices, triangles = self._pair
            all_vertices, largest = vertices[np.unique(triangles)], 0.0
            few = all_vertices[:: max(len(all_vertices) // _FEW, 1)]
            for points, other in ((few, pair), (_samples(*pair), self._pair), (all_vertices, pair)):
                largest = max(largest, measure.sampled_distance(points, other, self.threads, progress))
                if largest > self.tolerance:
                    break
            return largest / self.tolerance

        return work

    def judged(self, arrays):
        """Returns work that gives what measured() gives, or fit.REFUSED if that is at most 1 and more faces would cross."""

        def work(progress):
            deviation = self.measured(arrays)(progress)
            if deviation <= 1 and self.exact:
                pair = Surface(arrays, self.surface.matrix).world(), arrays.triangles
                ways = measure.both_ways(pair, self._pair, self.tolerance, self.threads, progress)
                if not all(way.within(self.tolerance) for way in ways):
                    deviation = max(way.upper for way in ways) / self.tolerance
            if deviation > 1 or not self._keeps_crossings_out:
                return deviation
            after = len(solidity.crossing_pairs(arrays, self.threads, progress))
            before = solidity.facts(self.surface, self.threads, progress, again=False)["crossing_pairs"] if after else 0
            return fit.REFUSED if self._would_cross(before, after) else deviation

        return work

    def _would_cross(self, before, after):
        """Whether crossings are kept out and more pairs of faces cross after than before, or too many to be counted."""
        would = self._keeps_crossings_out and (after > before or after >= solidity.MOST_PAIRS)
        self.crossed |= would
        return would

    def certified(self, arrays):
        """Returns work that gives the result of certify() for the mesh as Blender will store it, and "solidity", the result
        of solidity.compared().

        The work raises NotProved unless the mesh is within the tolerance both ways, and WouldCross if more faces cross.
        """

        def work(progress):
            surface = Surface(arrays, self.surface.matrix)
            found = certify(surface, self.reference, self.tolerance, 0, self.threads, progress)
            if not Verdict.certified(found, self.tolerance).passed:
                ways = (report.percent(found[way][1], self.size) for way in ("forward", "backward"))
                raise NotProved(
                    "the result is up to {} of the size from the reference, and the reference up to {} from the "
                    "result".format(*ways)
                )
            self.left = len(arrays.triangles)
            before, after = (solidity.facts(one, self.threads, progress) for one in (self.surface, surface))
            if self._would_cross(before["crossing_pairs"], after["crossing_pairs"]):
                raise WouldCross(
                    f"{solidity.pair_count(after['crossing_pairs'])} pairs of faces would cross: press Decimate, which keeps "
                    "crossings out, or set Crossings to Allow in its options"
                )
            return found | {"solidity": solidity.compared(before, after)}

        return work

    def line(self, certified):
        """Returns the outcome as one line of text."""
        forward, backward = (report.percent(certified[way][1], self.size) for way in ("forward", "backward"))
        word = Verdict.certified(certified, self.tolerance).word
        return (
            f"{word}: {len(self.surface.arrays.triangles):,} -> {self.left:,} triangles, tolerance "
            f"{100 * self.tolerance / self.size:.4g} % = {self.tolerance:.3g}, result within {forward}, reference within "
            f"{backward} (proved)"
        )
