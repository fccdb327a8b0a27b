# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs in a process of its own what needs the packages of benchmark/other_tools.txt: the tools, and trimesh.

`tool_server.py read IN VERTICES.npy TRIANGLES.npy` reads a mesh file and merges points at the same place.
`tool_server.py serve TOOL VERTICES.npy TRIANGLES.npy THREADS` reads a request per line on stdin and answers in JSON on stdout.
"""

import json
import os
import sys

import numpy as np

from tool_calls import TOOLS


def merged(vertices, triangles):
    """Merges points at the same place, and leaves out triangles with a repeated corner and points without a triangle."""
    points, first = np.unique(np.asarray(vertices, np.float32), axis=0, return_inverse=True)
    corners = first.ravel()[triangles]
    a, b, c = corners.T
    corners = corners[(a != b) & (b != c) & (c != a)]
    used, corners = np.unique(corners, return_inverse=True)
    return points[used], corners.reshape(-1, 3).astype(np.int32)


def read(source, vertices, triangles):
    import trimesh

    mesh = trimesh.load_mesh(source, process=False)
    points, corners = merged(mesh.vertices, mesh.faces)
    np.save(vertices, points)
    np.save(triangles, corners)


def serve(name, vertices, triangles, threads):
    """Answers requests until stdin ends. A request is a line {"what": "run" or "search", "parameter": x}.

    The answer to a request is a line on stdout; the resulting mesh is written to result_*.npy.
    """
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # Messages of the tools go to stderr, so that stdout has only answers.
    tool = TOOLS[name]
    vertices, triangles = np.load(vertices), np.load(triangles)
    for line in sys.stdin:
        asked = json.loads(line)
        try:
            points, corners, seconds = getattr(tool, asked["what"])(
                vertices, triangles, asked["parameter"], int(threads)
            )
            np.save("result_vertices.npy", np.asarray(points, np.float64))
            np.save("result_triangles.npy", np.asarray(corners, np.int32))
            answer = {"seconds": seconds}
        except Exception as error:  # The row of the tool in the table shows the error.
            answer = {"failure": " ".join(str(error).split()) or type(error).__name__}
        print(json.dumps(answer), file=answers, flush=True)


if __name__ == "__main__":
    {"read": read, "serve": serve}[sys.argv[1]](*sys.argv[2:])
