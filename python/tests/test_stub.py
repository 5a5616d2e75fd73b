"""The type stub has the names and parameters of the module."""

import ast
import inspect
import unittest
from pathlib import Path

import lightpaths
from lightpaths import _lightpaths

STUB = Path(lightpaths.__file__).parent / "_lightpaths.pyi"


def is_public(name):
    return not name.startswith("_") or name in {"__getitem__", "__len__", "__contains__", "__iter__"}


def parameters(function):
    """Names of the parameters of a method in the stub, without the first."""
    arguments = function.args.posonlyargs + function.args.args + function.args.kwonlyargs
    return [argument.arg for argument in arguments[1:]]


def functions(node):
    return [item for item in node.body if isinstance(item, ast.FunctionDef)]


def members(node):
    """Public names of a class in the stub: None for a property, else its parameters."""
    return {
        item.name: None if item.decorator_list else parameters(item)
        for item in functions(node)
        if is_public(item.name)
    }


class Stub(unittest.TestCase):
    def setUp(self):
        body = ast.parse(STUB.read_text(encoding="utf-8")).body
        values = {node.targets[0].id: node.value for node in body if isinstance(node, ast.Assign)}
        self.exported = ast.literal_eval(values["__all__"])
        self.classes = {node.name: node for node in body if isinstance(node, ast.ClassDef)}

    def test_classes(self):
        there = {name for name, value in vars(_lightpaths).items() if inspect.isclass(value)}
        self.assertEqual({name for name in self.classes if not name.startswith("_")}, there)
        self.assertEqual(self.exported, _lightpaths.__all__)
        errors = {name for name in lightpaths.__all__ if name.endswith("Error")}
        self.assertEqual(there | errors | {"__version__"}, set(lightpaths.__all__))

    def test_members(self):
        for name, node in self.classes.items():
            if name.startswith("_"):
                continue
            own = vars(getattr(_lightpaths, name))
            stub = members(node)
            there = {member for member in own if is_public(member)}
            self.assertEqual(set(stub), there, name)
            for member, named in stub.items():
                if named is None:
                    self.assertTrue(inspect.isdatadescriptor(own[member]), f"{name}.{member}")
                elif not member.startswith("__"):
                    signature = inspect.signature(own[member])
                    self.assertEqual(named, list(signature.parameters)[1:], f"{name}.{member}")

    def test_constructors(self):
        made = {name: item for name, node in self.classes.items() for item in functions(node) if item.name == "__new__"}
        self.assertEqual(sorted(made), ["Renderer", "Scene"])
        for name, item in made.items():
            signature = inspect.signature(getattr(_lightpaths, name))
            self.assertEqual(parameters(item), list(signature.parameters), name)

    def test_setters(self):
        for name, node in self.classes.items():
            for item in node.body:
                decorators = getattr(item, "decorator_list", [])
                if any(isinstance(decorator, ast.Attribute) for decorator in decorators):
                    self.assertTrue(hasattr(vars(getattr(_lightpaths, name))[item.name], "__set__"))

    def test_the_package_is_typed(self):
        self.assertTrue((STUB.parent / "py.typed").is_file())


if __name__ == "__main__":
    unittest.main()
