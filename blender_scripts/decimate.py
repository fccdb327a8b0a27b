# SPDX-License-Identifier: GPL-3.0-or-later
"""Decimates a mesh file within a tolerance. The proof, in both directions, is of the mesh that is in the written file.

blender --background --python blender_scripts/decimate.py -- IN OUT --tolerance 1%
"""

import io
import json
import math
import sys
import time
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parent))
try:
    import numpy as np

    import command_line as cli
    import decimate_options
    import file_report
    import pictures
    from addon import units
    from addon.errors import NOT_PROVED, NotWritten, Refused
    from addon.files import file_io, safe_files, side_files
    from addon.files.gltf_extras import GEOMETRIC_ERROR
    from addon.mesh import mesh_io
    from addon.proof import report, solidity
    from addon.proof.certify import certify
    from addon.reference import snapshots, tolerances
except ImportError as error:  # After an uncaught exception Blender would end with exit code 0.
    print(f"decimate.py: Blender's Python lacks a package: {error}; install Debian's python3-numpy", file=sys.stderr)
    sys.exit(2)


class Output:
    """One file that is written: OUT, or a level of detail beside OUT's name, with its side files and its picture."""

    def __init__(self, path, extension, picture):
        self.path = path
        self.target = safe_files.Target(path, "OUT")
        place = self.target.place
        # A symbolic link may lead to a name without the extension, but the exporter needs the extension.
        self.exported = place if place.suffix.lower() == extension else place.with_name(place.name + extension)
        self.sides = [
            safe_files.Target(path, "OUT's side file") for path in side_files.written_with(self.exported, extension)
        ]
        self.picture = safe_files.Target(picture, "--picture") if picture else None
        for target in (self.target, *self.sides):
            if target.is_device:
                raise cli.Stop(f"{target.name}: this is a device or a pipe, not a file")


class Command:
    """One run: for OUT, or for each level of detail, reads IN, decimates each object, writes beside OUT, reads that file back
    and certifies it. At the end all files are moved to their places."""

    def __init__(self, options, staged):
        self.options = options
        self.staged = staged
        self.last_stage_ended = time.perf_counter()
        self.seconds = {}
        self.textures = set()  # the places of the textures that are written
        file_io.extension_of(options.input)
        extension = file_io.extension_of(options.output)
        self.outputs = [
            Output(self._level_name(options.output, i), extension, self._level_name(options.picture, i))
            for i in range(self._levels())
        ]
        self.report = safe_files.Target(options.report, "--report") if options.report else None
        self._require_apart()
        if options.picture:
            pictures.require("--picture", options.picture)
        # This refuses a folder that cannot be written to before the work begins.
        for target in self._targets_written():
            if not target.is_device:
                staged.folder(target)

    def _levels(self):
        return len(self.options.lod or self.options.lod_pixels or [None])

    def _level_name(self, path, level):
        """Returns the name of a file of one level, or `path` itself if there are no levels or if it is None."""
        if self.options.tolerance or not path:
            return path
        path = Path(path)
        return str(path.with_name(f"{path.stem}_LOD{level}{path.suffix}"))

    def _require_apart(self):
        """Refuses a written file that is also read. Only OUT may be IN; their side files may then be the same, too."""
        read = cli.reads("IN", self.options.input)
        if self.options.reference:
            reference = cli.reads("--reference", self.options.reference)
            reference_is_in = safe_files.identity(self.options.reference) == safe_files.identity(self.options.input)
        else:
            reference, reference_is_in = [], True
        outputs = [(target.name, target.place) for one in self.outputs for target in (one.target, *one.sides)]
        pictures_too = [self.report, *(one.picture for one in self.outputs)]
        others = [(target.name, target.place) for target in pictures_too if target]
        safe_files.require_apart(outputs + others, [])
        safe_files.require_apart(others, read + reference)
        out_is_in = safe_files.identity(self.options.input) in {
            safe_files.identity(one.target.place) for one in self.outputs
        }
        if not out_is_in:
            safe_files.require_apart(outputs, read + reference)
        elif not reference_is_in:
            safe_files.require_apart(outputs, reference)

    def run(self):
        wholes = [self._level(i, output) for i, output in enumerate(self.outputs)]
        seconds = {**self.seconds, "total": sum(self.seconds.values())}
        if self.options.tolerance:
            written = {**wholes[0], "seconds": seconds}
        else:
            written = {"version": wholes[0]["version"], "levels": wholes, "seconds": seconds}
        if self.report:
            self.staged.write(self.report, (json.dumps(written, indent=1) + "\n").encode())
        # OUT itself is moved last: once it is there, all of its side files are, too.
        for output in self.outputs:
            self.staged.add(output.target, self.staged.folder(output.target) / output.exported.name)
        self.staged.publish()
        for whole in wholes:
            for note in [*(repair["message"] for repair in whole["repairs"]), *whole["warnings"]]:
                print(f"note: {note}")
        for whole, output in zip(wholes, self.outputs):
            name = "" if self.options.tolerance else f"{output.exported.name}: "
            print(f"{name}{report.line(whole, whole['seconds']['total'])}")
        return 0

    def _level(self, level, output):
        """Writes one file beside its place. Returns its report. Each level reads IN anew, so none comes from another."""
        seconds_before = dict(self.seconds)
        if level:
            bpy.ops.wm.read_factory_settings(use_empty=True)
        reference_file = self._read("--reference", self.options.reference) if self.options.reference else None
        for ob in reference_file.objects if reference_file else ():
            ob.name = "reference " + ob.name  # This leaves the plain names to the objects of IN, which are read next.
        source = self._read("IN", self.options.input)
        whole_input = {"file": self.options.input, **source.counts}
        names = [ob.name for ob in source.objects]
        reference_objects = self._pair(source.objects, reference_file)
        references = [snapshots.surface_of(ob) for ob in reference_objects]
        own = reference_objects is source.objects
        inputs = references if own else [snapshots.surface_of(ob) for ob in source.objects]
        size = snapshots.joined(references).size()
        tolerance = self._tolerances(size)[level]
        rounding = file_io.rounding(output.exported, source.objects)
        working = tolerance - rounding
        if working <= 0:
            raise cli.Stop(
                f"{self._asked()}: {tolerance:.3g} is less than the rounding when {output.exported.suffix} is written; "
                "use .ply for OUT, and objects without location, rotation and scale in IN"
            )
        perimeter = self.options.largest_perimeter
        self.largest_perimeter = cli.in_units(perimeter, size) if perimeter else 0.0
        runs = [
            self._decimate(ob, reference, min(working, surface.size()), target)
            for ob, reference, surface, target in zip(
                source.objects, reference_objects, references, self._targets(source.objects)
            )
        ]
        if not self.options.tolerance:
            for ob, run in zip(source.objects, runs):
                ob[GEOMETRIC_ERROR] = file_report.deviation(run) + rounding
        repairs = source.repairs + (reference_file.repairs if reference_file else [])
        whole = self._write(output, source, names, inputs, references, runs, tolerance, size)
        whole["input"] = whole_input
        whole["repairs"] = repairs + whole["repairs"]
        if not self.options.tolerance:
            whole[GEOMETRIC_ERROR] = file_report.deviation(whole)
        self._end_stage("write")
        seconds = {stage: took - seconds_before.get(stage, 0.0) for stage, took in self.seconds.items()}
        whole["seconds"] = {**seconds, "total": sum(seconds.values())}
        return whole

    def _read(self, what, path):
        found = file_io.read_file(path)
        took = self._end_stage("read")
        self._say(f"{what} {path}: {found.counts['triangles']:,} triangles", took)
        return found

    def _end_stage(self, stage):
        """Adds the time since the end of the stage before to `stage`, and returns it. So the stages sum to the total."""
        now = time.perf_counter()
        took = now - self.last_stage_ended
        self.last_stage_ended = now
        self.seconds[stage] = self.seconds.get(stage, 0.0) + took
        return took

    @staticmethod
    def _say(text, took):
        print(f"{text}, {report.duration(took)}", flush=True)

    def _pair(self, objects, reference_file):
        """Returns, for each object, the object to which its tolerance refers."""
        if reference_file is None:
            return objects
        by_name = {ob.name.removeprefix("reference "): ob for ob in reference_file.objects}
        if all(ob.name in by_name for ob in objects) and len(by_name) == len(objects):
            return [by_name[ob.name] for ob in objects]
        if len(objects) > 1:
            raise cli.Stop(
                f"--reference {self.options.reference}: its objects ({', '.join(by_name)}) are not those of IN "
                f"({', '.join(ob.name for ob in objects)}); give them the same names"
            )
        if len(by_name) == 1:
            return reference_file.objects
        whole = snapshots.joined([snapshots.surface_of(ob) for ob in reference_file.objects]).arrays
        joined = bpy.data.objects.new("reference", mesh_io.new_mesh("reference", whole.vertices, whole.triangles))
        bpy.context.collection.objects.link(joined)
        return [joined]

    def _asked(self):
        """Returns the option that gives the tolerance, or the tolerances of the levels."""
        return "--tolerance" if self.options.tolerance else "--lod" if self.options.lod else "--lod-pixels"

    def _tolerances(self, size):
        """Returns the tolerance of each output as a length. Stops at one that is too large, or out of order."""
        if self.options.lod_pixels:
            distance = cli.in_units(self.options.distance, size)
            view = self.options.fov or 50, self.options.height or 1080
            found = [tolerances.seen_as(pixels, distance, *view) for pixels in self.options.lod_pixels]
        else:
            found = [cli.in_units(asked, size) for asked in self.options.lod or [self.options.tolerance]]
        for i, tolerance in enumerate(found):
            level = "" if self.options.tolerance else f"level {i}: "
            if tolerance > size:
                raise cli.Stop(
                    f"{self._asked()}: {level}{tolerance:.6g} is more than the size of the reference, {size:.6g}"
                )
            if i and tolerance <= found[i - 1]:
                raise cli.Stop(
                    f"{self._asked()}: {level}{tolerance:.6g} is not more than {found[i - 1]:.6g} of level {i - 1}"
                )
        return found

    def _targets(self, objects):
        target = self.options.target_triangles
        if target is None:
            return [None] * len(objects)
        triangles = [mesh_io.triangle_count(ob.data) for ob in objects]
        return [max(1, target * count // sum(triangles)) for count in triangles]

    def _decimate(self, ob, reference, tolerance, target):
        """Decimates one object and returns the operator's report."""
        if ob.data.users > 1:  # Objects of a glTF file may share a mesh.
            ob.data = ob.data.copy()
        for other in bpy.context.view_layer.objects:
            other.select_set(other == ob)
        bpy.context.view_layer.objects.active = ob
        if reference is not ob:
            ob.tolvol.reference_kind, ob.tolvol.reference_object = "OBJECT", reference
        asked = {"target_triangles": target} if target else {"use_target": False}
        if self.options.placement:
            asked["placement"] = self.options.placement.upper()
        length = _not_above(tolerance)
        try:
            with file_io.quiet():
                bpy.ops.tolvol.decimate(
                    tolerance_length=length,
                    tolerance_length_converted=repr(units.shortest(length)),
                    keep="ONE" if self.options.one_sided else "BOTH",
                    effort=self.options.effort.upper(),
                    crossings=self.options.crossings.upper(),
                    max_normal_angle=math.radians(self.options.max_normal_angle),
                    max_seconds=self.options.max_seconds or 0,
                    close_holes=self.options.close_holes,
                    largest_perimeter=self.largest_perimeter,
                    outside=self.options.outside.upper(),
                    threads=self.options.threads or 0,
                    **asked,
                )
        except RuntimeError as error:
            message = str(error).removeprefix("Error: ").strip()
            if "Traceback" in message:
                raise
            raise cli.Stop(f"{ob.name}: {message}", cli.NOT_PROVED if NOT_PROVED in message else cli.USAGE) from None
        run = json.loads(ob.tolvol.last_run)
        took = self._end_stage("transfer")
        for stage, part in run["seconds"].items():
            self.seconds[stage] = self.seconds.get(stage, 0.0) + part
            self.seconds["transfer"] -= part
        self._say(f"decimated {ob.name}: {report.counts(run)}", took)
        return run

    def _write(self, output, source, names, inputs, references, runs, tolerance, size):
        """Writes a file beside its place, reads it back and certifies it. Returns the report of the whole file."""
        written = self._export(output, source.objects)
        self._say(f"wrote {output.exported.name} and read it back", self._end_stage("write"))
        found = {ob.name: snapshots.surface_of(ob) for ob in written.objects}
        if found.keys() == set(names):
            judged = [
                self._certify(found[name], reference, tolerance, run["outside"]["faces"])
                for name, reference, run in zip(names, references, runs)
            ]
        else:  # The format holds only one object, so all objects were joined.
            kept = sum(run["outside"]["faces"] for run in runs)
            judged = [self._certify(snapshots.joined(found.values()), snapshots.joined(references), tolerance, kept)]
        whole = file_report.summary(names, runs, judged, tolerance, size, self.options.target_triangles)
        if len(runs) == 1:
            before = runs[0]["solidity"]["before"]
        else:
            before = solidity.facts(snapshots.joined(inputs), self.options.threads)
        after = solidity.facts(snapshots.joined(found.values()), self.options.threads, again=False)
        whole["solidity"] = solidity.compared(before, after)
        pairs = {when: whole["solidity"][when]["crossing_pairs"] for when in ("before", "after")}
        whole["crossings"] = pairs
        if self.options.crossings == "keep_out" and pairs["after"] > pairs["before"]:
            whole["warnings"].append(
                f"{solidity.pair_count(pairs['after'])} pairs of faces cross in the file, "
                f"{solidity.pair_count(pairs['before'])} did before: the file rounds coordinates, and objects are "
                "decimated one by one"
            )
        whole["output"] = {"file": output.path, **written.counts}
        for kind, count in source.extras.items():
            if lost := count - written.extras.get(kind, 0):
                message = f"{lost} of the {count} {kind} of IN are not in OUT"
                whole["repairs"].append({"kind": kind, "count": lost, "message": message})
        self._say("certified both ways", self._end_stage("certify"))
        print(f"{output.exported.name}: {solidity.line(whole['solidity']['after'])}")
        if not report.proved(whole):
            raise cli.Stop(f"{NOT_PROVED}: {report.intervals(whole)}; {output.path} was not written", cli.NOT_PROVED)
        if output.picture:
            self._draw(output, snapshots.joined(found.values()), snapshots.joined(references), tolerance, size)
            self._say(f"drew {output.picture.path}", self._end_stage("picture"))
        return whole

    def _export(self, output, objects):
        """Writes objects with their side files beside the place of `output`. Returns the MeshFile that is read back there."""
        folder = self.staged.folder(output.target)
        file = folder / output.exported.name
        try:
            file_io.write_file(file, objects, output.exported.parent)
            textures = []
            if file.suffix.lower() == ".gltf":
                meant = [safe_files.identity(target.place) for target in self._targets_written()]
                textures = side_files.keep_textures(
                    file, output.exported.parent, lambda path: safe_files.identity(path) in meant
                )
        except OSError as error:
            raise output.target.failed(error) from None
        for texture in textures:
            place = output.exported.with_name(texture.name)
            if place not in self.textures:  # Levels share their textures.
                self.staged.add(safe_files.Target(place, "the texture"), texture, new=True)
                self.textures.add(place)
        for side in output.sides:
            if (folder / side.path.name).exists():
                self.staged.add(side, folder / side.path.name)
        bpy.ops.wm.read_factory_settings(use_empty=True)
        try:
            return file_io.read_file(file)
        except Refused as error:
            reason = str(error).removeprefix(f"{file}: ")
            raise NotWritten(
                f"{output.target.name}: the written file cannot be read back ({reason}); check the free space on the disk"
            ) from None

    def _targets_written(self):
        of_outputs = [target for one in self.outputs for target in (one.target, *one.sides, one.picture)]
        return [target for target in (*of_outputs, self.report) if target]

    def _certify(self, surface, reference, tolerance, kept):
        # Where the file holds the result bit for bit, the measurements of the operator are measurements of the file.
        return certify(surface, reference, tolerance, kept, self.options.threads, again=False)

    def _draw(self, output, result, reference, tolerance, size):
        surfaces = [(surface.world(), surface.arrays.triangles) for surface in (result, reference)]
        like = self.options.reference or self.options.input
        png = io.BytesIO()
        pictures.save_deviation(png, *surfaces, tolerance, size, like, self.options.threads)
        self.staged.write(output.picture, png.getvalue())


def _not_above(length):
    """Returns the largest number that Blender's float32 property can express and that is not above `length`."""
    candidate = np.float32(length)
    while units.shortest(candidate) > length:
        candidate = np.nextafter(candidate, np.float32(0))
    return float(candidate)


def main(options):
    with safe_files.Staged() as staged:
        try:
            return Command(options, staged).run()
        except NotWritten as error:
            raise cli.Stop(f"{error}; {options.output} was not written", cli.NOT_WRITTEN) from None


cli.run(__file__, decimate_options.arguments, main)
