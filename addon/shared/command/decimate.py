# SPDX-License-Identifier: GPL-3.0-or-later
"""Decimates a mesh file within a tolerance. The proof, in both directions, is of the mesh that is in the written file.

How files are read, decimated and written is up to the `files` of each program, an object with these methods. The objects that
they exchange have a `name`, which may be set.

    extension_of(path)         the extension of a path; raises Refused for one that is not known
    read(path)                 the content of a file: objects; counts {vertices, triangles}; repairs; extras {kind: number}.
                               Raises Refused, which names the file
    clear()                    forgets all objects
    surface_of(object)         its Surface
    object_of(surface)         an object with this Surface
    rounding(path, objects)    an upper bound of the distance by which writing to this path moves a vertex
    decimate(object, reference, tolerance, target, options, largest_perimeter)
                               decimates an object and returns the run (proof/report.py). reference: an object, or the same one;
                               target: a number of triangles, or None; largest_perimeter: 0 for no limit
    followed(title, work)      work(progress), with what the Progress of the package says shown on a terminal, or progress None
    note_deviation(object, length)    leaves the deviation of a level of detail with the object, for formats that hold it
    write(path, objects, folder)      writes a file; folder: where it will be moved to. Raises OSError
"""

import io
import json
from pathlib import Path

from ..decimation import seen_as
from ..errors import NOT_PROVED, NotWritten, Refused
from ..files import safe_files, side_files
from ..proof import report, solidity
from ..proof.certify import certify
from ..surface import joined
from . import arguments, file_report, pictures
from .arguments import Stop, in_units, require_within_size
from .stages import Stages, say

# The name of the entry of a glTF node's extras, and of the report. It is the word of 3D Tiles for how far a level is from the
# full detail, as a length.
GEOMETRIC_ERROR = "geometricError"


def reads(option, path):
    """Returns pairs (name for messages, path) for a mesh file that is read and for all files that it needs."""
    return [(f"{option} {path}", path)] + [(f"{file} of {option}", file) for file in side_files.read_with(path)]


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
                raise Stop(f"{target.name}: this is a device or a pipe, not a file")


class Command:
    """One run: for OUT, or for each level of detail, reads IN, decimates each object, writes beside OUT, reads that file back
    and certifies it. At the end all files are moved to their places."""

    def __init__(self, options, staged, files):
        self.options = options
        self.staged = staged
        self.files = files
        self.stages = Stages()
        self.textures = set()  # the places of the textures that are written
        files.extension_of(options.input)
        extension = files.extension_of(options.output)
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
        read = reads("IN", self.options.input)
        if self.options.reference:
            reference = reads("--reference", self.options.reference)
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
        seconds = {**self.stages.seconds, "total": sum(self.stages.seconds.values())}
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
        seconds_before = dict(self.stages.seconds)
        self.files.clear()
        reference_file = self._read("--reference", self.options.reference) if self.options.reference else None
        for ob in reference_file.objects if reference_file else ():
            ob.name = "reference " + ob.name  # This leaves the plain names to the objects of IN, which are read next.
        source = self._read("IN", self.options.input)
        whole_input = {"file": self.options.input, **source.counts}
        names = [ob.name for ob in source.objects]
        reference_objects = self._pair(source.objects, reference_file)
        references = [self.files.surface_of(ob) for ob in reference_objects]
        own = reference_objects is source.objects
        inputs = references if own else [self.files.surface_of(ob) for ob in source.objects]
        size = joined(references).size()
        tolerance = self._tolerances(size)[level]
        rounding = self.files.rounding(output.exported, source.objects)
        working = tolerance - rounding
        if working <= 0:
            raise Stop(
                f"{self._asked()}: {tolerance:.3g} is less than the rounding when {output.exported.suffix} is written; "
                "use .ply for OUT, and objects without location, rotation and scale in IN"
            )
        perimeter = self.options.largest_perimeter
        self.largest_perimeter = in_units(perimeter, size) if perimeter else 0.0
        runs = [
            self._decimate(ob, reference, min(working, surface.size()), target)
            for ob, reference, surface, target in zip(
                source.objects, reference_objects, references, self._targets(inputs)
            )
        ]
        if not self.options.tolerance:
            for ob, run in zip(source.objects, runs):
                self.files.note_deviation(ob, file_report.deviation(run) + rounding)
        repairs = source.repairs + (reference_file.repairs if reference_file else [])
        whole = self._write(output, source, names, inputs, references, runs, tolerance, size)
        whole["input"] = whole_input
        whole["repairs"] = repairs + whole["repairs"]
        if not self.options.tolerance:
            whole[GEOMETRIC_ERROR] = file_report.deviation(whole)
        self.stages.end("write")
        seconds = {stage: took - seconds_before.get(stage, 0.0) for stage, took in self.stages.seconds.items()}
        whole["seconds"] = {**seconds, "total": sum(seconds.values())}
        return whole

    def _read(self, what, path):
        found = self.files.read(path)
        took = self.stages.end("read")
        say(f"{what} {path}: {found.counts['triangles']:,} triangles", took)
        return found

    def _pair(self, objects, reference_file):
        """Returns, for each object, the object to which its tolerance refers."""
        if reference_file is None:
            return objects
        by_name = {ob.name.removeprefix("reference "): ob for ob in reference_file.objects}
        if all(ob.name in by_name for ob in objects) and len(by_name) == len(objects):
            return [by_name[ob.name] for ob in objects]
        if len(objects) > 1:
            raise Stop(
                f"--reference {self.options.reference}: its objects ({', '.join(by_name)}) are not those of IN "
                f"({', '.join(ob.name for ob in objects)}); give them the same names"
            )
        if len(by_name) == 1:
            return reference_file.objects
        return [self.files.object_of(joined([self.files.surface_of(ob) for ob in reference_file.objects]))]

    def _asked(self):
        """Returns the option that gives the tolerance, or the tolerances of the levels."""
        return "--tolerance" if self.options.tolerance else "--lod" if self.options.lod else "--lod-pixels"

    def _tolerances(self, size):
        """Returns the tolerance of each output as a length. Stops at one that is too large, or out of order."""
        if self.options.lod_pixels:
            distance = in_units(self.options.distance, size)
            view = self.options.fov or 50, self.options.height or 1080
            found = [seen_as(pixels, distance, *view) for pixels in self.options.lod_pixels]
        else:
            found = [in_units(asked, size) for asked in self.options.lod or [self.options.tolerance]]
        for i, tolerance in enumerate(found):
            level = "" if self.options.tolerance else f": level {i}"
            require_within_size(tolerance, size, f"{self._asked()}{level}")
            if i and tolerance <= found[i - 1]:
                raise Stop(
                    f"{self._asked()}{level}: {tolerance:.6g} is not more than {found[i - 1]:.6g} of level {i - 1}"
                )
        return found

    def _targets(self, inputs):
        """Returns the number of triangles that is asked for of each object, or None; inputs: their Surfaces."""
        target = self.options.target_triangles
        if target is None:
            return [None] * len(inputs)
        triangles = [len(surface.arrays.triangles) for surface in inputs]
        return [max(1, target * count // sum(triangles)) for count in triangles]

    def _decimate(self, ob, reference, tolerance, target):
        """Decimates one object and returns the report about it."""
        run = self.files.decimate(ob, reference, tolerance, target, self.options, self.largest_perimeter)
        took = self.stages.end("transfer")
        for stage, part in run["seconds"].items():
            self.stages.seconds[stage] = self.stages.seconds.get(stage, 0.0) + part
            self.stages.seconds["transfer"] -= part
        say(f"decimated {ob.name}: {report.counts(run)}", took)
        return run

    def _write(self, output, source, names, inputs, references, runs, tolerance, size):
        """Writes a file beside its place, reads it back and certifies it. Returns the report of the whole file."""
        written = self._export(output, source.objects)
        say(f"wrote {output.exported.name} and read it back", self.stages.end("write"))
        found = {ob.name: self.files.surface_of(ob) for ob in written.objects}
        if found.keys() == set(names):
            judged = [
                self._certify(found[name], reference, tolerance, run["outside"]["faces"])
                for name, reference, run in zip(names, references, runs)
            ]
        else:  # The format holds only one object, so all objects were joined.
            kept = sum(run["outside"]["faces"] for run in runs)
            judged = [self._certify(joined(found.values()), joined(references), tolerance, kept)]
        whole = file_report.summary(names, runs, judged, tolerance, size, self.options.target_triangles)
        one = len(runs) == 1
        before = runs[0]["solidity"]["before"] if one else solidity.facts(joined(inputs), self.options.threads)
        after = solidity.facts(joined(found.values()), self.options.threads, again=False)
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
        say("measured both ways", self.stages.end("certify"))
        print(f"{output.exported.name}: {solidity.line(whole['solidity']['after'])}")
        if not report.proved(whole):
            raise Stop(f"{NOT_PROVED}: {report.intervals(whole)}; {output.path} was not written", arguments.NOT_PROVED)
        if output.picture:
            self._draw(output, joined(found.values()), joined(references), tolerance, size)
            say(f"drew {output.picture.path}", self.stages.end("picture"))
        return whole

    def _export(self, output, objects):
        """Writes objects with their side files beside the place of `output`. Returns the MeshFile that is read back there."""
        folder = self.staged.folder(output.target)
        file = folder / output.exported.name
        try:
            self.files.write(file, objects, output.exported.parent)
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
        self.files.clear()
        try:
            return self.files.read(file)
        except Refused as error:
            reason = str(error).removeprefix(f"{file}: ")
            raise NotWritten(
                f"{output.target.name}: the written file cannot be read back ({reason}); check the free space on the disk"
            ) from None

    def _targets_written(self):
        of_outputs = [target for one in self.outputs for target in (one.target, *one.sides, one.picture)]
        return [target for target in (*of_outputs, self.report) if target]

    def _certify(self, surface, reference, tolerance, kept):
        threads = self.options.threads
        # Where the file holds the result bit for bit, the measurements of the decimation are measurements of the file.
        return self.files.followed(
            "measuring", lambda progress: certify(surface, reference, tolerance, kept, threads, progress, again=False)
        )

    def _draw(self, output, result, reference, tolerance, size):
        surfaces = [(surface.world(), surface.arrays.triangles) for surface in (result, reference)]
        like = self.options.reference or self.options.input
        png = io.BytesIO()
        pictures.save_deviation(png, *surfaces, tolerance, size, like, self.options.threads)
        self.staged.write(output.picture, png.getvalue())


def decimate(options, files):
    """Runs the command and returns its exit code. Raises Stop, Refused and the errors of the package."""
    with safe_files.Staged() as staged:
        try:
            return Command(options, staged, files).run()
        except NotWritten as error:
            raise Stop(f"{error}; {options.output} was not written", arguments.NOT_WRITTEN) from None
