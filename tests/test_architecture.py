"""A module imports only from packages below its own, and there is no import cycle."""

import ast
from pathlib import Path

import pytest

import drake_aerial

PACKAGE = Path(drake_aerial.__file__).parent

# From the bottom up. A package may import from those above it in this list, and from itself.
ORDER = (
    "_version",
    "choices",
    "errors",
    "geometry",
    "parallel",
    "io",
    "cloud",
    "features",
    "scene",
    "density",
    "skill",
    "statics",
    "contacts",
    "plant",
    "references",
    "dynamics",
    "estimation",
    "control",
    "simulation",
    "configuration",
    "named_inputs",
    "annotation",
    "visualization",
    "study",
    "demo",
    "testing",
    "cli",
    "__main__",
)
# Packages that know nothing of each other, though one stands below the other in the list.
STRANGERS = {
    "plant": {"skill", "contacts"},
    "references": {"skill", "contacts"},
    "dynamics": {"skill", "contacts"},
    "estimation": {"skill", "contacts"},
    "control": {"skill", "contacts"},
    "annotation": {"contacts", "plant", "control", "simulation"},
}


def module_of(path: Path) -> str:
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


# The names of the root and their modules, which `lazy_loader` reads from the stub.
HOMES = {
    alias.name: node.module
    for node in ast.parse((PACKAGE / "__init__.pyi").read_text()).body
    if isinstance(node, ast.ImportFrom)
    for alias in node.names
}
MODULES = {module_of(path): path for path in sorted(PACKAGE.rglob("*.py"))}


def imports_of(module: str) -> set[str]:
    """Return the package's modules that `module` imports, also in functions and TYPE_CHECKING."""
    found = set()
    for node in ast.walk(ast.parse(MODULES[module].read_text())):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{module}: a relative import hides which package it comes from"
            names = [f"{node.module}.{alias.name}" for alias in node.names]
        else:
            continue
        for name in names:
            if not f"{name}.".startswith("drake_aerial."):
                continue
            inner = name.removeprefix("drake_aerial").lstrip(".")
            # A name of the root is loaded from its home.
            inner = HOMES.get(inner, inner)
            # `from package import module` is the module, `from module import name` the module too.
            while inner not in MODULES:
                inner = inner.rpartition(".")[0]
            if inner:
                found.add(inner)
    return found - {module}


@pytest.fixture(scope="module")
def graph() -> dict[str, set[str]]:
    """What every module of the package imports."""
    return {module: imports_of(module) for module in MODULES if module}


def cycles(graph: dict[str, set[str]]) -> list[list[str]]:
    """Return the strongly connected components of more than one module (Tarjan)."""
    index, low, stack, found = {}, {}, [], []

    def visit(module):
        index[module] = low[module] = len(index)
        stack.append(module)
        for other in sorted(graph.get(module, ())):
            if other not in index:
                visit(other)
                low[module] = min(low[module], low[other])
            elif other in stack:
                low[module] = min(low[module], index[other])
        if low[module] == index[module]:
            component = []
            while not component or component[-1] != module:
                component.append(stack.pop())
            if len(component) > 1:
                found.append(sorted(component))

    for module in sorted(graph):
        if module not in index:
            visit(module)
    return found


def package_of(module: str) -> str:
    return module.split(".")[0]


def test_every_package_has_its_place(graph):
    assert {package_of(module) for module in graph} == set(ORDER)


@pytest.mark.parametrize("package", ORDER)
def test_packages_import_only_from_packages_below_them(package, graph):
    allowed = set(ORDER[: ORDER.index(package) + 1]) - STRANGERS.get(package, set())
    upwards = [
        f"{module} imports {other}"
        for module in graph
        if package_of(module) == package
        for other in sorted(graph[module])
        if package_of(other) not in allowed
    ]
    assert not upwards, "\n".join(upwards)


def test_no_modules_import_each_other(graph):
    """Print the module graph; pytest shows it with -s, or where the test fails."""
    for module in sorted(graph, key=lambda name: (ORDER.index(package_of(name)), name)):
        print(f"{module}: {', '.join(sorted(graph[module])) or '-'}")
    assert cycles(graph) == []


def test_the_search_for_cycles_finds_one():
    assert cycles({"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": {"a"}}) == [["a", "b", "c"]]


def test_no_file_is_a_drawer():
    drawers = {"utils.py", "util.py", "helpers.py", "common.py", "misc.py"}
    assert not [path for path in MODULES.values() if path.name in drawers]
