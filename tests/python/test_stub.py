# SPDX-License-Identifier: GPL-3.0-or-later
"""The typed stub of the package declares what the package holds: names, classes, parameters, defaults and results."""

import ast
import enum
from pathlib import Path

import pytest
import tolvol

STUB = ast.parse(Path(tolvol.__file__).with_name("__init__.pyi").read_text())


def declared(body):
    """Returns the public names that are declared in a stub or in a class of it, with their nodes."""
    names = {}
    for node in body:
        if isinstance(node, (ast.ClassDef, ast.FunctionDef)):
            names[node.name] = node
        elif isinstance(node, ast.AnnAssign):
            names[node.target.id] = node
        elif isinstance(node, ast.Assign):
            names[node.targets[0].id] = node
    return {name: node for name, node in names.items() if not name.startswith("_") or name in SPECIAL}


SPECIAL = ("__init__", "__version__")
PUBLIC = declared(STUB.body)
CLASSES = {name: node for name, node in PUBLIC.items() if isinstance(node, ast.ClassDef)}


def decorators(node):
    return [decorator.id for decorator in getattr(node, "decorator_list", [])]


def callables():
    """Returns the functions and methods of the stub as pairs (the path of names to it, node)."""
    for name, node in PUBLIC.items():
        if isinstance(node, ast.FunctionDef):
            yield (name,), node
    for owner, body in CLASSES.items():
        for name, node in declared(body.body).items():
            if isinstance(node, ast.FunctionDef) and "property" not in decorators(node):
                yield (owner, name), node


def lookup(path):
    found = tolvol
    for name in path:
        found = getattr(found, name)
    return found


def signature(node):
    """Returns the names of the parameters by position, those by name, and the defaults."""
    given = node.args
    positional = [each.arg for each in given.posonlyargs + given.args]
    by_name = [each.arg for each in given.kwonlyargs]
    defaults = dict(zip(positional[len(positional) - len(given.defaults) :], given.defaults))
    defaults |= {name: default for name, default in zip(by_name, given.kw_defaults) if default is not None}
    return positional, by_name, {name: plain(ast.literal_eval(value)) for name, value in defaults.items()}


def is_number(annotation):
    """Whether a compiled function takes a number here, and not None."""
    return annotation is not None and ast.unparse(annotation) in ("int", "float")


def plain(value):
    return tuple(value) if isinstance(value, list) else value


def compiled(path):
    """Returns the signature of a compiled function as a node. Its docstring begins with it."""
    return ast.parse(f"def {lookup(path).__doc__.splitlines()[0]}: ...").body[0]


def test_names():
    assert set(PUBLIC) == set(tolvol.__all__)
    assert {name for name in vars(tolvol._native) if not name.startswith("_")} <= set(tolvol.__all__)
    assert all(hasattr(tolvol, name) for name in tolvol.__all__)


@pytest.mark.parametrize("path", [path for path, _ in callables()], ids=".".join)
def test_parameters_defaults_and_results(path):
    node, found = dict(callables())[path], compiled(path)
    assert signature(node) == signature(found)
    numbers = {each.arg for each in found.args.args + found.args.kwonlyargs if is_number(each.annotation)}
    assert not any(value is None for name, value in signature(found)[2].items() if name in numbers)
    result = ast.unparse(found.returns)
    if result.startswith("tolvol."):
        assert ast.unparse(node.returns) == result.removeprefix("tolvol.")
    else:
        assert (ast.unparse(node.returns) == "None") == (result == "None")


@pytest.mark.parametrize("name", CLASSES)
def test_members(name):
    there, node = getattr(tolvol, name), CLASSES[name]
    members = declared(node.body)
    if issubclass(there, enum.Enum):
        assert [(each.name, each.value) for each in there] == [
            (each, ast.literal_eval(value.value)) for each, value in members.items()
        ]
        return
    bases = [base.__name__ for base in there.__bases__ if not base.__name__.startswith("pybind11")]
    assert [ast.unparse(base) for base in node.bases] == bases
    inherited = {each for base in bases if base in CLASSES for each in declared(CLASSES[base].body)}
    assert {each for each in vars(there) if not each.startswith("_")} - inherited == set(members) - {"__init__"}
    for each, declaration in members.items():
        assert (type(vars(there).get(each)) is property) == ("property" in decorators(declaration)), each


def test_everything_is_documented():
    for path, _ in callables():
        assert "".join(lookup(path).__doc__.splitlines()[1:]), path
    for name, node in CLASSES.items():
        assert getattr(tolvol, name).__doc__, name
        for each, declaration in declared(node.body).items():
            assert "property" not in decorators(declaration) or vars(getattr(tolvol, name))[each].__doc__, (name, each)
