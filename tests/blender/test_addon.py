# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on as a package: registering, the compiled module, installing it as a zip and installing over it."""

import ast
import importlib
import os
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import bpy
import pytest
import tomllib

import addon
from addon import native, preferences

ROOT = Path(__file__).resolve().parents[2]


def registered():
    names = {name for kind in (bpy.types.Operator, bpy.types.Panel, bpy.types.PropertyGroup) for name in dir(bpy.types)}
    kinds = [getattr(bpy.app.handlers, name) for name in dir(bpy.app.handlers) if name.endswith(("_post", "_pre"))]
    handlers = [handler.__qualname__ for kind in kinds for handler in kind if handler.__module__.startswith("addon")]
    return {name for name in names if "TOLVOL" in name}, hasattr(bpy.types.Object, "tolvol"), handlers


def test_unregister_mirrors_register():
    after = registered()
    assert all(after)
    addon.unregister()
    try:
        assert not any(registered())
    finally:
        addon.register()
    assert registered() == after


def test_versions_agree():
    manifest = tomllib.loads((ROOT / "addon/blender_manifest.toml").read_text())
    project = re.search(r"project\(tolvol VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text())[1]
    info = ast.literal_eval((ROOT / "addon/__init__.py").read_text().split("bl_info = ")[1].split("\n}")[0] + "}")
    assert manifest["version"] == project == ".".join(map(str, info["version"])) == native.module.__version__
    assert manifest["name"] == info["name"] and info["blender"] == (3, 4, 0)


# Blender keeps so many bytes of the description of a class and cuts off the rest.
LONGEST_TOOLTIP = 239


def registered_classes():
    """Returns all classes of the add-on that are registered in Blender."""
    modules = [module for name, module in list(sys.modules.items()) if name.split(".")[0] == "addon"]
    found = {value for module in modules for value in vars(module).values() if isinstance(value, type)}
    ours = (cls for cls in found if issubclass(cls, bpy.types.bpy_struct) and cls.__module__.startswith("addon"))
    return sorted((cls for cls in ours if getattr(cls, "is_registered", False)), key=lambda cls: cls.__name__)


def shown_text(cls):
    """Returns (the description that Blender shows for a registered class, the description in the source)."""
    if issubclass(cls, bpy.types.Operator):
        rna = getattr(bpy.ops.tolvol, cls.bl_idname.split(".")[1]).get_rna_type()
    else:
        rna = cls.bl_rna
    return rna, getattr(cls, "bl_description", None) or cls.__doc__ or ""


def tooltips(cls):
    """Yields (name, description) of a registered class, its properties and their choices."""
    rna, written = shown_text(cls)
    yield cls.__name__, written
    blender_own = bpy.types.UIList.bl_rna.properties if issubclass(cls, bpy.types.UIList) else ()
    for item in rna.properties:
        if item.identifier in ("rna_type", "name") or item.identifier in blender_own:
            continue
        yield f"{cls.__name__}.{item.identifier}", item.description
        if item.type == "ENUM":
            for choice in item.enum_items:
                yield f"{cls.__name__}.{item.identifier} {choice.identifier}", choice.description


def test_tooltips_and_labels_follow_blender():
    """Every operator and setting has a description, which ends without a full stop and is not cut off by Blender."""
    classes = registered_classes()
    for kind in (bpy.types.Operator, bpy.types.PropertyGroup, bpy.types.AddonPreferences, bpy.types.Menu):
        assert any(issubclass(cls, kind) for cls in classes), kind
    for cls in classes:
        rna, written = shown_text(cls)
        if issubclass(cls, bpy.types.Operator):
            assert written and rna.description == written, cls
        for which, text in tooltips(cls):
            assert len(text.encode()) <= LONGEST_TOOLTIP, (which, text)
            if not issubclass(cls, (bpy.types.Panel, bpy.types.Menu)) and which != cls.__name__:
                assert not text.endswith("."), (which, text)
            if issubclass(cls, bpy.types.Operator):
                assert not text.endswith(".") and "\n" not in text, (which, text)


def test_loaded_module_is_a_private_copy():
    loaded = Path(sys.modules[native.module.__name__ + "._native"].__file__)
    assert loaded.parent != native.path.parent and re.fullmatch(r"tolvol_[0-9a-f]{16}", loaded.parent.name)
    mapped = Path("/proc/self/maps").read_text()
    assert str(loaded) in mapped and str(native.path) not in mapped
    assert importlib.reload(native).module is native.module  # A module with the same content is loaded only once.


def run_blender(script, tmp_path, within=(), **environment):
    """Runs a script in a Blender with settings of its own and returns its stdout. The script's last line has to be ok().

    within: a command that runs Blender.
    """
    text = "import sys, os, traceback\ndef ok():\n    sys.stdout.flush()\n    os._exit(0)\ntry:\n"
    text += (
        "".join(f"    {line}\n" for line in script.splitlines()) + "except BaseException:\n    traceback.print_exc()\n"
    )
    text += "sys.stdout.flush()\nos._exit(1)\n"
    (tmp_path / "script.py").write_text(text)
    done = subprocess.run(
        [*within, bpy.app.binary_path, "--background", "--factory-startup", "--python", tmp_path / "script.py"],
        env=os.environ
        | dict.fromkeys(("BLENDER_USER_RESOURCES", "BLENDER_USER_SCRIPTS"), str(tmp_path / "user"))
        | environment,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def package():
    """The zip that the build makes."""
    path = ROOT / f"build/release/tolerance_volumes-{native.module.__version__}.zip"
    assert path.is_file(), "cmake --build build/release --target extension makes it"
    return path


def repack(path, text=lambda name, content: content, keep=lambda name: True):
    """Writes a changed copy of the package."""
    with zipfile.ZipFile(package()) as original, zipfile.ZipFile(path, "w") as archive:
        for entry in original.infolist():
            if keep(entry.filename) and not entry.is_dir():
                archive.writestr(entry.filename, text(entry.filename, original.read(entry)))
    return path


def newer(name, content):
    if name != "tolerance_volumes/__init__.py":
        return content
    assert b'"version": (0, 1, 0)' in content
    # The file also becomes longer: Python uses the old compiled file if length and time in seconds are the same.
    return content.replace(b'"version": (0, 1, 0)', b'"version": (0, 2, 0)') + b"# newer\n"


def test_package_holds_what_is_here():
    files = {file.relative_to(ROOT / "addon") for kind in ("*.py", "*.toml") for file in (ROOT / "addon").rglob(kind)}
    with zipfile.ZipFile(package()) as archive:
        for file in files:
            assert archive.read(f"tolerance_volumes/{file}") == (ROOT / "addon" / file).read_bytes(), (
                f"pack {file} anew"
            )
        others = {name for name in archive.namelist() if not name.endswith("/")} - {
            f"tolerance_volumes/{file}" for file in files
        }
        shaders = {name for name in others if name.startswith("tolerance_volumes/shaders/")}
        for name in shaders:
            assert archive.read(name) == (ROOT / "shaders" / Path(name).name).read_bytes(), f"pack {name} anew"
        packages = "boost1.74-dev", "cgal-dev", "epoxy0", "glm-dev", "gmp10", "openmesh-dev"
        notices = {f"tolerance_volumes/licences/lib{name}.txt" for name in packages}
        notices.add("tolerance_volumes/licences/pybind11-dev.txt")
        assert notices <= others
        for word, library in (
            ("Lesser", "libgmp10"),
            ("Permission is", "libepoxy0"),
            ("Redistribution", "libopenmesh-dev"),
        ):
            assert word in archive.read(f"tolerance_volumes/licences/{library}.txt").decode()
    libraries = {name for name in others if re.fullmatch(r"tolerance_volumes/bin/tolvol/(_native\.|lib).*", name)}
    modules = {name for name in libraries if "/_native." in name}
    assert {Path(name).name for name in modules} == {path.name for path in native.path.parent.glob("_native.*.so")}
    assert native.path.name in {Path(name).name for name in modules} and len(shaders) == 2
    listed = subprocess.run(["readelf", "-d", native.path], capture_output=True, text=True, check=True).stdout
    needed = set(re.findall(r"\(NEEDED\).*\[(.+)\]", listed))
    # These come with every Linux for PCs that Blender runs on.
    everywhere = {"ld-linux-x86-64.so.2", "libc.so.6", "libm.so.6", "libgcc_s.so.1", "libstdc++.so.6"}
    assert needed and needed - everywhere <= {Path(name).name for name in libraries}
    pictures = {f"tolerance_volumes/pictures/{name}.png" for name in ("guard", "overlay", "panel")}
    assert others - libraries - shaders - notices - pictures == {
        "tolerance_volumes/LICENSE",
        "tolerance_volumes/manual.html",
        "tolerance_volumes/bin/tolvol/__init__.py",
    }


def test_the_preferences_open_the_manual_of_the_package(tmp_path):
    zipfile.ZipFile(package()).extractall(tmp_path)
    out = run_blender(
        f"""
import sys
sys.path.insert(0, {str(tmp_path)!r})
from tolerance_volumes import preferences
print("manual at", preferences.manual())
ok()
""",
        tmp_path,
    )
    packed = tmp_path / "tolerance_volumes" / "manual.html"
    assert f"manual at {packed}" in out
    page = packed.read_text()
    assert "<h1>Manual</h1>" in page and "<table>" in page
    assert f'<h2 id="{preferences._PROBLEM}">' in page
    pictures = re.findall(r'<img src="([^"]*)"', page)
    assert len(pictures) >= 3 and all((packed.parent / picture).is_file() for picture in pictures)
    assert preferences.manual() == ROOT / "docs" / "manual.md"


DECIMATE = """
bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=5)
assert bpy.ops.tolvol.decimate(tolerance_percent=1) == {'FINISHED'}
assert len(bpy.context.object.data.polygons) < 1000
"""


def test_zip_installs_and_installs_over_itself(tmp_path):
    first, second = package(), repack(tmp_path / "second.zip", text=newer)
    out = run_blender(
        f"""
import bpy, addon_utils
def install(path):
    bpy.ops.preferences.addon_install(filepath=path, overwrite=True)
    bpy.ops.preferences.addon_enable(module='tolerance_volumes')
    import tolerance_volumes
    return tolerance_volumes
installed = install({str(first)!r})
assert installed.bl_info['version'] == (0, 1, 0)
assert os.path.join('user', 'addons') in installed.__file__
assert bpy.context.preferences.addons['tolerance_volumes'].preferences.threads == 0
{DECIMATE}
with open('/proc/self/maps') as mapped:
    libraries = [line for line in mapped if 'OpenMesh' in line]
assert all('/tolvol_' in line for line in libraries), libraries  # that of the package, not the system's
old = sys.modules['tolerance_volumes.reference']
installed = install({str(second)!r})
assert installed.bl_info['version'] == (0, 2, 0)
assert sys.modules['tolerance_volumes.reference'] is not old
{DECIMATE}
bpy.ops.preferences.addon_disable(module='tolerance_volumes')
assert not hasattr(bpy.types.Object, 'tolvol')
ok()""",
        tmp_path,
        TOLVOL_PYTHON_PATH="",
    )
    assert "Error" not in out


@pytest.mark.skipif(bpy.app.version < (4, 2), reason="extensions came with 4.2")
def test_zip_installs_as_an_extension_and_over_itself(tmp_path):
    manifest = "tolerance_volumes/blender_manifest.toml"
    second = repack(
        tmp_path / "second.zip",
        text=lambda name, content: content.replace(b'"0.1.0"', b'"0.2.0"') if name == manifest else content,
    )
    out = run_blender(
        f"""
import bpy
def install(path):
    bpy.ops.extensions.package_install_files(filepath=path, repo='user_default', enable_on_install=True)
    return sys.modules['bl_ext.user_default.tolerance_volumes']
for path in {str(package())!r}, {str(second)!r}:
    installed = install(path)
    assert installed.native.module is not None, installed.native.reason
    assert installed.native.path.is_relative_to({str(tmp_path / "user")!r}), installed.native.path
    assert bpy.context.preferences.addons[installed.__name__].preferences.threads == 0
    {DECIMATE.replace(chr(10), chr(10) + "    ")}
bpy.ops.preferences.addon_disable(module=installed.__name__)
assert not hasattr(bpy.types.Object, 'tolvol')
ok()""",
        tmp_path,
        TOLVOL_PYTHON_PATH="",
    )
    assert "Error" not in out


@pytest.mark.parametrize(
    ("others", "reason"),
    [
        ([], "is missing"),
        (["_native.cpython-39-x86_64-linux-gnu.so"], "_native.cpython-39.* is not made for this Blender's Python"),
    ],
)
def test_without_the_module_the_addon_stays_and_says_why(tmp_path, others, reason):
    archive = repack(tmp_path / "addon.zip", keep=lambda name: "/bin/" not in name)
    with zipfile.ZipFile(archive, "a") as extended:
        for name in others:
            extended.writestr(f"tolerance_volumes/bin/tolvol/{name}", b"")
    run_blender(
        f"""
import bpy, re
bpy.ops.preferences.addon_install(filepath={str(archive)!r})
bpy.ops.preferences.addon_enable(module='tolerance_volumes')
import tolerance_volumes
from tolerance_volumes import native
from tolerance_volumes.operators import blocked
assert native.module is None and re.search({reason!r}, native.reason), native.reason
bpy.ops.mesh.primitive_cube_add()
assert blocked.decimate_blocked(bpy.context.object) == native.reason
assert not bpy.ops.tolvol.decimate.poll() and not bpy.ops.tolvol.set_reference.poll()
bpy.context.object.tolvol.tolerance_percent = 2
ok()""",
        tmp_path,
        TOLVOL_PYTHON_PATH="",
    )


def test_a_module_that_does_not_load_is_a_reason(tmp_path):
    package = tmp_path / "tolvol"
    package.mkdir()
    (package / "__init__.py").write_text("from ._native import decimate")
    (package / f"_native{importlib.machinery.EXTENSION_SUFFIXES[0]}").write_bytes(b"no library")
    run_blender(
        f"""
sys.path.insert(0, {str(ROOT)!r})
from addon import native
assert native.module is None and 'does not load' in native.reason, native.reason
ok()""",
        tmp_path,
        TOLVOL_PYTHON_PATH=str(tmp_path),
    )


def noexec(*folders):
    """Returns a command that runs another command with these folders mounted noexec."""
    bind = "".join(f"mount --bind '{f}' '{f}' && mount -o remount,bind,noexec '{f}' && " for f in folders)
    command = ["unshare", "--mount", "--map-root-user", "sh", "-c", f'{bind}exec "$@"', "sh"]
    if subprocess.run([*command, "true"], capture_output=True).returncode:
        pytest.skip("this machine does not let a test mount a folder")
    return command


@pytest.mark.parametrize("everywhere", [False, True], ids=["another folder", "no folder"])
def test_a_temporary_folder_mounted_noexec(tmp_path, everywhere):
    temporary, cache = tmp_path / "temporary", tmp_path / "cache"
    for folder in (temporary, cache):
        folder.mkdir()
    checks = "assert native.module is not None, native.reason\n"
    if everywhere:
        checks = (
            "assert native.module is None\n"
            f"assert {str(temporary)!r} in native.reason and {str(cache)!r} in native.reason, native.reason\n"
            "assert 'permits a copy' in native.reason and 'TMPDIR' in native.reason, native.reason\n"
        )
    run_blender(
        f"sys.path.insert(0, {str(ROOT)!r})\nfrom addon import native\n{checks}ok()",
        tmp_path,
        noexec(temporary, *((cache, ROOT / "addon") if everywhere else ())),
        TMPDIR=str(temporary),
        XDG_CACHE_HOME=str(cache),
    )
    assert not [left for folder in (temporary, cache, ROOT / "addon") for left in folder.glob("tolvol-*")]


def test_module_is_looked_for_in_the_environments_folder(tmp_path):
    # The content differs, but it is still a library.
    shutil.copytree(native.path.parent, tmp_path / "tolvol")
    path = tmp_path / "tolvol" / native.path.name
    path.write_bytes(native.path.read_bytes() + b"\0")
    out = run_blender(
        f"""
sys.path.insert(0, {str(ROOT)!r})
from addon import native
print(native.path)
assert str(native.path) == {str(path)!r}
print(os.path.basename(os.path.dirname(native.module.__file__)))
ok()""",
        tmp_path,
        TOLVOL_PYTHON_PATH=str(tmp_path),
    )
    assert Path(native.module.__file__).parent.name not in out and "tolvol_" in out


def test_no_module_is_loaded_twice_in_this_process():
    assert [name for name in sys.modules if re.fullmatch(r"tolvol_[0-9a-f]{16}", name)] == [
        Path(native.module.__file__).parent.name
    ]
