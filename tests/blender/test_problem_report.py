# SPDX-License-Identifier: GPL-3.0-or-later
"""The text for a report of a problem: what it says, and that it holds nothing private."""

import os
import platform
from pathlib import Path
from types import SimpleNamespace

import bpy

import addon
from addon import native
from addon.operators import problem_report
from addon.overlay import reasons
from addon.proof import kept_warnings
from drawn import drawn, sidebar
from scenes import torus


def report():
    return problem_report.problem_report(bpy.context)


def test_it_names_versions_system_processor_and_the_active_mesh():
    torus()
    lines = report().splitlines()
    version = ".".join(map(str, addon.bl_info["version"]))
    assert lines[:2] == [f"Tolerance Volumes {version}", f"Compiled module: {native.module.__version__}"]
    assert lines[2].startswith(f"Blender: {bpy.app.version_string}, ")
    assert lines[4] == f"System: {platform.platform()}"
    assert lines[5].startswith("Processor: ") and lines[5].endswith(f", {os.cpu_count()} cores")
    assert lines[6] == "OpenGL: not known, because Blender runs without a window"
    assert lines[7:] == ["Active mesh: 1,152 vertices, 1,152 faces, NOT CHECKED"]
    bpy.data.objects.remove(bpy.context.object)
    assert report().splitlines()[7:] == ["No mesh is active"]


def test_it_names_the_graphics_driver_and_its_refusal(monkeypatch):
    told = SimpleNamespace(
        renderer_get=lambda: "Card/PCIe", vendor_get=lambda: "Maker", version_get=lambda: "4.6 (Core) 23.1"
    )
    monkeypatch.setattr(problem_report.gpu, "platform", told)
    monkeypatch.setattr(problem_report, "bpy", SimpleNamespace(app=SimpleNamespace(background=False)))
    assert problem_report._driver() == "Card/PCIe, Maker, 4.6 (Core) 23.1"
    monkeypatch.undo()
    monkeypatch.setattr(reasons, "broken", ["the shader /tmp/shaders/legend.frag does not compile"])
    assert "The driver refuses to draw: the shader <path> does not compile" in report().splitlines()


def test_it_holds_the_kept_warnings_without_names_and_paths():
    ob = torus("My Secret Project")
    ob.vertex_groups.new(name="client")
    kept_warnings.keep(
        ob,
        [
            "My Secret Project: the group client has no weights, clients are not meant",
            f"The file {Path.home()}/my files/scan.ply was not found, nor \\\\server\\share\\a.ply or C:\\Users\\me\\b.ply",
        ],
        {"UV islands": 1841},
    )
    assert report().splitlines()[8:] == [
        "Warning: <name>: the group <name> has no weights, clients are not meant",
        "Warning: The file <path> <path> was not found, nor <path> or <path>",
        "Vertices that had to stay: 1,841 by UV islands",
    ]


def test_it_says_why_there_is_no_module_without_the_paths(monkeypatch):
    folder = Path("/opt/my programs/blender/addons/bin")
    monkeypatch.setattr(native, "known_folders", lambda: [folder])
    monkeypatch.setattr(native, "module", None)
    monkeypatch.setattr(native, "reason", f"{folder}/tolvol/_native.so does not load: {folder}/libx.so: no such file")
    lines = report().splitlines()
    assert lines[1] == "Compiled module: <path> does not load: <path>: no such file"


def test_its_folders_are_those_that_the_reason_may_name():
    folders = set(map(str, native.known_folders()))
    assert {str(native.path.parents[1]), str(Path(native.__file__).resolve().parent)} <= folders


def test_the_button_in_the_preferences_copies_it():
    torus()
    shown = drawn(addon.preferences.TOLVOL_AP_preferences, sidebar()).buttons
    assert shown["tolvol.copy_problem_report"] == "Copy Problem Report"
    copied = SimpleNamespace(window_manager=SimpleNamespace(clipboard=""), active_object=bpy.context.active_object)
    said = []
    operator = SimpleNamespace(report=lambda kind, text: said.append((kind, text)))
    assert problem_report.TOLVOL_OT_copy_problem_report.execute(operator, copied) == {"FINISHED"}
    assert copied.window_manager.clipboard == report()
    assert said == [({"INFO"}, "The problem report is in the clipboard: paste it into your message")]
