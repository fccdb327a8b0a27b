# SPDX-License-Identifier: GPL-3.0-or-later
"""Holds one function for each tool that benchmark/other_tools.py compares.

Each function takes vertices (n, 3) float32, triangles (m, 3) int32, its parameter and the number of threads. It returns
vertices, triangles and the processor seconds of the tool's own call, without the conversion of arrays if the tool permits. Each
docstring quotes the tool's documentation of the parameter.
"""

import os
import resource
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
CGAL_PROGRAM = ROOT / "build" / "other_tools" / "cgal"
HAUSDORFF_STEPS = 16  # the number of steps in which PyMeshLab's number of triangles is bisected


def processor_seconds():
    """Returns the processor time of this process and of its children that have ended, on all cores together."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(usage.ru_utime + usage.ru_stime for usage in used)


def timed(call, *arguments, **named):
    started = processor_seconds()
    result = call(*arguments, **named)
    return result, processor_seconds() - started


def tolerance_volumes(**options):
    """`tolvol.decimate`, both ways. The time includes building the volume."""

    def run(vertices, triangles, tolerance, threads):
        sys.path.insert(0, os.environ.get("TOLVOL_PYTHON_PATH", str(ROOT / "build" / "release" / "python")))
        import tolvol

        def work():
            volume = tolvol.ToleranceVolume(vertices, triangles, tolerance, threads=threads)
            return tolvol.decimate(vertices, triangles, volume, threads=threads, **options)

        result, seconds = timed(work)
        return result.vertices, result.triangles, seconds

    return run


def meshlib(**settings):
    """DecimateSettings::maxError: "stop the decimation as soon as the estimated distance deviation from the original mesh is
    more than this value". It works on the mesh as one part: several parts in parallel leave more triangles in the search."""

    def run(vertices, triangles, error, threads):
        from meshlib import mrmeshnumpy, mrmeshpy

        mesh = mrmeshnumpy.meshFromFacesVerts(triangles, vertices)
        options = mrmeshpy.DecimateSettings()
        options.maxError = error
        options.packMesh = True
        for name, value in settings.items():
            setattr(options, name, value)
        _, seconds = timed(mrmeshpy.decimateMesh, mesh, options)
        return mrmeshnumpy.getNumpyVerts(mesh), mrmeshnumpy.getNumpyFaces(mesh.topology), seconds

    return run


def meshoptimizer(vertices, triangles, error, threads):
    """meshopt_simplify with meshopt_SimplifyErrorAbsolute: "treat error limit and resulting error as absolute instead of
    relative to mesh extents"."""
    import meshoptimizer

    left = np.zeros(triangles.size, np.uint32)
    indices = triangles.astype(np.uint32).ravel()
    count, seconds = timed(
        meshoptimizer.simplify,
        left,
        indices,
        vertices,
        target_index_count=0,
        target_error=error,
        options=meshoptimizer.SIMPLIFY_ERROR_ABSOLUTE,
    )
    return vertices, left[:count].reshape(-1, 3), seconds


def through_vtk(vertices, triangles, decimater):
    from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData

    points, cells, mesh = vtkPoints(), vtkCellArray(), vtkPolyData()
    points.SetData(numpy_to_vtk(vertices, deep=True))
    cells.SetData(3, numpy_to_vtk(triangles.ravel(), deep=True))
    mesh.SetPoints(points)
    mesh.SetPolys(cells)
    decimater.SetInputData(mesh)
    _, seconds = timed(decimater.Update)
    result = decimater.GetOutput()
    if not result.GetNumberOfPolys():
        return vertices, triangles[:0], seconds
    corners = vtk_to_numpy(result.GetPolys().GetConnectivityArray())
    return vtk_to_numpy(result.GetPoints().GetData()), corners.reshape(-1, 3), seconds


def vtk_quadric(vertices, triangles, error, threads):
    """vtkQuadricDecimation::SetMaximumError: "Maximum allowed absolute error for stopping criteria"."""
    from vtkmodules.vtkFiltersCore import vtkQuadricDecimation

    decimater = vtkQuadricDecimation()
    decimater.SetTargetReduction(1)
    decimater.SetMaximumError(error)
    return through_vtk(vertices, triangles, decimater)


def vtk_pro(vertices, triangles, error, threads):
    """vtkDecimatePro::SetAccumulateError: "a global error bounds, and the ivar MaximumError becomes a global bounds on mesh
    error". The topology is kept: otherwise the tool tears the mesh apart to go on, and the result is farther away."""
    from vtkmodules.vtkFiltersCore import vtkDecimatePro

    decimater = vtkDecimatePro()
    decimater.SetTargetReduction(1)
    decimater.PreserveTopologyOn()
    decimater.AccumulateErrorOn()
    decimater.SetErrorIsAbsolute(1)
    decimater.SetAbsoluteError(error)
    return through_vtk(vertices, triangles, decimater)


def open3d(vertices, triangles, error, threads):
    """simplify_quadric_decimation(maximum_error): "The maximum error where a vertex is allowed to be merged"."""
    import open3d

    geometry, utility = open3d.geometry, open3d.utility
    mesh = geometry.TriangleMesh(utility.Vector3dVector(vertices.astype(np.float64)), utility.Vector3iVector(triangles))
    result, seconds = timed(mesh.simplify_quadric_decimation, 0, maximum_error=error)
    return np.asarray(result.vertices), np.asarray(result.triangles), seconds


class MeshLab:
    """meshing_decimation_quadric_edge_collapse has no parameter for an error, only a number of triangles (targetfacenum)."""

    def __init__(self, vertices, triangles):
        import pymeshlab

        self.lab = pymeshlab
        self.reference = pymeshlab.Mesh(vertices.astype(np.float64), triangles)

    def decimated(self, count):
        meshes = self.lab.MeshSet()
        meshes.add_mesh(self.reference)
        meshes.meshing_decimation_quadric_edge_collapse(targetfacenum=count)
        mesh = meshes.current_mesh()
        mesh.compact()
        return mesh.vertex_matrix(), mesh.face_matrix()

    def distance(self, vertices, triangles):
        """Returns the larger get_hausdorff_distance of both ways, sampled at the vertices and at as many points of the faces as
        the reference has vertices."""
        meshes = self.lab.MeshSet()
        meshes.add_mesh(self.lab.Mesh(vertices, triangles))
        meshes.add_mesh(self.reference)
        options = {"samplevert": True, "sampleface": True, "samplenum": self.reference.vertex_number()}
        options["maxdist"] = self.lab.PercentageValue(100)
        return max(meshes.get_hausdorff_distance(sampledmesh=a, targetmesh=1 - a, **options)["max"] for a in (0, 1))


def pymeshlab_by_distance(vertices, triangles, tolerance, threads):
    """Halves the number of triangles until MeshLab's own distance is beyond the tolerance, then bisects. All of it is timed."""
    lab = MeshLab(vertices, triangles)

    def work():
        low, high, best = 0, len(triangles), (vertices, triangles)
        for _ in range(HAUSDORFF_STEPS):
            count = (low + high) // 2
            if not low < count < high:
                break
            result = lab.decimated(count)
            if lab.distance(*result) <= tolerance:
                high, best = count, result
            else:
                low = count
        return best

    (points, corners), seconds = timed(work)
    return points, corners, seconds


def pymeshlab_by_count(vertices, triangles, ratio, threads):
    """Asks for so many times fewer triangles by targetfacenum."""
    lab = MeshLab(vertices, triangles)
    (points, corners), seconds = timed(lab.decimated, max(4, round(len(triangles) / ratio)))
    return points, corners, seconds


def pyfqmr(vertices, triangles, epsilon, threads):
    """simplify_mesh_lossless(epsilon): "Maximal error after which a vertex is not deleted". The tool's page prefers this call
    to the other one when quality is the aim."""
    import pyfqmr

    simplifier = pyfqmr.Simplify()
    simplifier.setMesh(vertices.astype(np.float64), triangles)
    _, seconds = timed(simplifier.simplify_mesh_lossless, epsilon=epsilon, max_iterations=9999, verbose=False)
    points, faces, _ = simplifier.getMesh()
    return points, faces, seconds


def manifold3d(vertices, triangles, tolerance, threads):
    """Manifold.simplify(tolerance): "all surfaces will have moved by less than tolerance"."""
    import manifold3d

    solid = manifold3d.Manifold(manifold3d.Mesh(vertices, triangles.astype(np.uint32)))
    if solid.status() != manifold3d.Error.NoError:
        raise ValueError(f"refused: {solid.status().name}")

    def work():
        result = solid.simplify(tolerance)
        result.num_tri()  # This call makes Manifold compute the result, which it otherwise does later.
        return result

    result, seconds = timed(work)
    mesh = result.to_mesh()
    return mesh.vert_properties, mesh.tri_verts, seconds


def openmesh(vertices, triangles, tolerance, threads):
    """ModHausdorffT::set_tolerance: "set max error tolerance". ModQuadricT gives the order of collapses, because the Decimater's
    page asks for one module with priorities and other modules that only permit or refuse."""
    import openmesh

    mesh = openmesh.TriMesh(vertices.astype(np.float64), triangles)
    decimater = openmesh.TriMeshDecimater(mesh)
    quadric, hausdorff = openmesh.TriMeshModQuadricHandle(), openmesh.TriMeshModHausdorffHandle()
    decimater.add(quadric)
    decimater.add(hausdorff)
    decimater.module(quadric).unset_max_err()
    decimater.module(hausdorff).set_tolerance(tolerance)

    def work():
        decimater.initialize()
        decimater.decimate()

    _, seconds = timed(work)
    mesh.garbage_collection()
    return mesh.points(), mesh.face_vertex_indices(), seconds


def pytetwild(**settings):
    """tetrahedralize(epsilon): "Envelop size, specifying the maximum distance of the output surface from the input surface,
    relative to the bounding box size"; coarsen: "Coarsen the output as much as possible". The result is the surface of the
    tetrahedra."""

    def run(vertices, triangles, tolerance, threads):
        import pytetwild

        diagonal = np.linalg.norm(np.ptp(vertices[np.unique(triangles)].astype(np.float64), axis=0))
        (points, cells), seconds = timed(
            pytetwild.tetrahedralize,
            vertices.astype(np.float64),
            triangles,
            epsilon=tolerance / diagonal,
            num_threads=threads,
            coarsen=True,
            **settings,
        )
        faces = cells[:, [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]]].reshape(-1, 3)
        _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
        return points, faces[first[count == 1]], seconds

    return run


def cgal(vertices, triangles, distance, threads):
    """Polyhedral_envelope_filter: "dist is the parameter given to the polyhedral envelope", as in edge_collapse_envelope.cpp."""
    source, target = Path("in.bin"), Path("out.bin")
    with source.open("wb") as file:
        np.array([len(vertices), len(triangles)], np.int64).tofile(file)
        vertices.astype(np.float64).tofile(file)
        triangles.tofile(file)
    done = subprocess.run([CGAL_PROGRAM, source, target, repr(distance)], capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(done.stderr.strip().splitlines()[-1] if done.stderr else f"exit code {done.returncode}")
    with target.open("rb") as file:
        points, faces = np.fromfile(file, np.int64, 2)
        return (
            np.fromfile(file, np.float64, 3 * points).reshape(-1, 3),
            np.fromfile(file, np.int32, 3 * faces).reshape(-1, 3),
            float(done.stdout),
        )


def libigl(vertices, triangles, ratio, threads):
    """qslim(max_m, block_intersections): "desired number of output faces", and "whether to block intersections". There is no
    parameter for an error: this asks for so many times fewer triangles."""
    import igl

    arrays = np.asfortranarray(vertices, np.float64), np.asfortranarray(triangles)
    count = max(4, round(len(triangles) / ratio))
    (points, faces, *_), seconds = timed(igl.qslim, *arrays, count, block_intersections=True)
    return points, faces, seconds


def trueform(vertices, triangles, error, threads):
    """simplified(error_rel): "Error budget as a fraction of the mesh bounding-box diagonal. An edge is collapsed when its
    quadric error is <= error_rel * diagonal"."""
    import trueform

    diagonal = np.linalg.norm(np.ptp(vertices[np.unique(triangles)].astype(np.float64), axis=0))
    (faces, points), seconds = timed(trueform.simplified, (triangles, vertices), error_rel=error / diagonal)
    return points, faces, seconds


def opengl_decimate(vertices, triangles, error, threads):
    """SimplifyOptions.target_error: "deviation to stop at, a length in model units"."""
    import opengl_decimate

    options = opengl_decimate.SimplifyOptions(target_error=error)
    indices = triangles.astype(np.uint32).ravel()
    result, seconds = timed(opengl_decimate.simplify, {"POSITION": vertices}, indices, options)
    return result.attributes["POSITION"], result.indices.reshape(-1, 3), seconds


def through_blender(mode, vertices, triangles, parameter):
    """Runs tool_blender.py. The seconds are those of the modifier."""
    np.save("vertices.npy", vertices)
    np.save("triangles.npy", triangles)
    script = Path(__file__).with_name("tool_blender.py")
    command = ["blender", "--background", "--factory-startup", "--python-exit-code", "1", "--python", script]
    done = subprocess.run([*command, "--", mode, repr(parameter)], capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError((done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1])
    points, faces, seconds = (np.load(f"blender_{name}.npy") for name in ("vertices", "triangles", "seconds"))
    return points, faces, float(seconds)


def blender_collapse(vertices, triangles, ratio, threads):
    """DecimateModifier.ratio: "Ratio of triangles to reduce to". There is no parameter for an error."""
    return through_blender("COLLAPSE", vertices, triangles, max(4, len(triangles) / ratio))


def blender_planar(vertices, triangles, angle, threads):
    """DecimateModifier.angle_limit: "Only dissolve angles below this". The modifier merges faces that are nearly in one plane
    and cuts the result into triangles. There is no parameter for an error."""
    return through_blender("DISSOLVE", vertices, triangles, angle)


@dataclass
class Tool:
    """A tool. `run` is called with the tolerance as a length; it is None for a tool that has no parameter for an error.
    `search` is called with other parameters in the search; it is None for a tool without a search."""

    title: str
    package: str  # the name of the package on PyPI, or tolvol, cgal, or blender
    run: Callable | None
    search: Callable | None = None
    parameter: str = "error"  # of `search`: an error, an angle, or the ratio of the input's triangles over the result's


def searched(title, package, run):
    return Tool(title, package, run, run)


FAST, THOROUGH = tolerance_volumes(), tolerance_volumes(effort="thorough")
SUBSET = tolerance_volumes(placement="subset")
WEIGHTED = {
    "angleWeightedDistToPlane": True,
    "stabilizer": 0,
}  # MeshLib's documentation advises both settings for surfaces that are curved everywhere.

TOOLS = {
    "ours": Tool("**Tolerance Volumes**", "tolvol", FAST),
    "thorough": Tool("**Tolerance Volumes**, thorough", "tolvol", THOROUGH),
    "subset": Tool("**Tolerance Volumes**, vertices of the input alone", "tolvol", SUBSET),
    "blender-collapse": Tool("Blender, Decimate, collapse", "blender", None, blender_collapse, "ratio"),
    "blender-planar": Tool("Blender, Decimate, planar", "blender", None, blender_planar, "angle"),
    "cgal": searched("CGAL, polyhedral envelope", "cgal", cgal),
    "libigl": Tool("libigl, qslim without crossings", "libigl", None, libigl, "ratio"),
    "manifold3d": searched("Manifold, simplify", "manifold3d", manifold3d),
    "meshlib": searched("MeshLib", "meshlib", meshlib()),
    "meshlib-weighted": searched("MeshLib, weighted by angles", "meshlib", meshlib(**WEIGHTED)),
    "meshoptimizer": searched("meshoptimizer", "meshoptimizer", meshoptimizer),
    "open3d": searched("Open3D", "open3d", open3d),
    "opengl-decimate": searched("opengl_decimate", "opengl_decimate", opengl_decimate),
    "openmesh": searched("OpenMesh, ModHausdorff", "openmesh", openmesh),
    "pyfqmr": searched("pyfqmr, lossless", "pyfqmr", pyfqmr),
    "pymeshlab": Tool("PyMeshLab, bisected", "pymeshlab", pymeshlab_by_distance, pymeshlab_by_count, "ratio"),
    "pytetwild": searched("pytetwild, coarsened", "pytetwild", pytetwild()),
    "pytetwild-long": searched("pytetwild, edges of any length", "pytetwild", pytetwild(edge_length_fac=1.0)),
    "trueform": searched("trueform, simplified", "trueform", trueform),
    "vtk-pro": searched("VTK, vtkDecimatePro", "vtk", vtk_pro),
    "vtk-quadric": searched("VTK, vtkQuadricDecimation", "vtk", vtk_quadric),
}
