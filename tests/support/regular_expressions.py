"""All regular expressions of the package, each searched in texts that repeat what it repeats.

Run as `python regular_expressions.py [FILE ...]`, it prints those outside of these files that do not end
within `SECONDS` of a processor for a text of `LETTERS` letters: what grows with the length takes a hundredth
of that, what grows with its square all of it.
"""

from __future__ import annotations

import ast
import gc
import importlib
import os
import pkgutil
import re
import resource
import sys
from itertools import chain, product
from pathlib import Path

import tumble
from repetitions import SOAK

LETTERS = 1 << 17
SECONDS = 1
FEWER = ((1 << 12, 0.002), (1 << 14, 0.04))
"""Letters, and seconds from which on a text is worth to be tried with more of them."""
SEARCHING = ("search", "sub", "subn", "split", "findall", "finditer")
PUMPS = [*' \ta0x."{<']
"""Letters that are repeated."""
MORE_PUMPS = (
    *" \ta0.x_-/\"'#\n[(=:,;{}@<?>|*%+A",
    "a ", "#\n", "1.", "//", ":a", "a:", "a=", ",a", "[a", "(a", "a(", "a[", "{a", ": ", "&a", ">(",
)  # fmt: skip
ENDS = ("\x00", "=\x00", "x")
_LITERAL = re.compile(
    r"(?<=[(=\s,!])/(?![/*])(?P<pattern>(?:\\.|\[(?:\\.|[^\]\\])*\]|[^/\\\[\s])(?:\\.|\[(?:\\.|[^\]\\])*\]|[^/\\\[])*)/[gimsuy]*(?=[).,;\s])"
)
_parser = getattr(re, "_parser", None) or __import__("sre_parse")
_constants = getattr(re, "_constants", None) or __import__("sre_constants")
_REPEATS = ("MAX_REPEAT", "MIN_REPEAT", "POSSESSIVE_REPEAT")


def sources():
    """Returns the trees of all modules of the package that may use expressions, by file."""
    folder = Path(tumble.__file__).parent
    texts = {path: path.read_text() for path in sorted(folder.rglob("*.py"))}
    used = re.compile(rf"\bre\b|\.(?:{'|'.join(SEARCHING)})\(")
    return {path: ast.parse(text) for path, text in texts.items() if used.search(text)}


def compiled():
    """Imports all modules; returns the expressions that they compile meanwhile, with their places."""
    found, true_compile, folder = [], re.compile, str(Path(tumble.__file__).parent)

    def noted(pattern, flags=0):
        made, caller = true_compile(pattern, flags), sys._getframe(1)
        if caller.f_code.co_filename.startswith(folder):
            found.append((made, Path(caller.f_code.co_filename), caller.f_lineno))
        return made

    re.compile = noted
    for name in [each for each in sys.modules if each.partition(".")[0] == "tumble"]:
        if not name.endswith("_core"):
            del sys.modules[name]
    for each in pkgutil.walk_packages(tumble.__path__, "tumble."):
        if not each.name.endswith(("__main__", "_core")) and ".migrations" not in each.name:
            importlib.import_module(each.name)
    re.compile = true_compile
    return found


def searched(nodes):
    """Returns names of expressions that look for a match at each place of a text, of nodes by file."""
    calls = (node.func for of_file in nodes.values() for node in of_file if isinstance(node, ast.Call))
    return {
        call.value.id
        for call in calls
        if isinstance(call, ast.Attribute) and call.attr in SEARCHING and isinstance(call.value, ast.Name)
    }


def expressions():
    """Yields place, expression and way of matching of all that the package holds."""
    # Nodes are listed once: each expression looks for its own among those of its file.
    nodes = {path: list(ast.walk(tree)) for path, tree in sources().items()}
    names = searched(nodes)
    assigned = {path: [each for each in of if isinstance(each, ast.Assign)] for path, of in nodes.items()}
    for made, path, line in compiled():
        targets = {
            target.id
            for node in assigned[path]
            if node.lineno <= line <= (node.end_lineno or line)
            for target in node.targets
            if isinstance(target, ast.Name)
        }
        yield f"{path.name}:{line}", made, "search" if targets & names else "fullmatch"
    for path, of_file in nodes.items():
        for node in of_file:
            function = getattr(node, "func", None)
            if not (isinstance(function, ast.Attribute) and getattr(function.value, "id", "") == "re"):
                continue
            pattern = node.args[0] if node.args else None
            if function.attr in ("compile", "escape") or not isinstance(pattern, ast.Constant):
                continue
            way = "search" if function.attr in SEARCHING else "fullmatch"
            yield f"{path.name}:{node.lineno}", re.compile(pattern.value), way


def of_the_page():
    """Yields the same of the page in a browser, whose expressions search as those of Python do."""
    for path in sorted((Path(__file__).parents[2] / "web" / "src").rglob("*.ts")):
        for number, line in enumerate(path.read_text().splitlines(), start=1):
            for found in _LITERAL.finditer(line):
                pattern = re.sub(r"\\[up]\{\w+\}", "a", found["pattern"], flags=re.ASCII)
                pattern = pattern.replace("(?<", "(?P<").replace("(?P<!", "(?<!").replace("(?P<=", "(?<=")
                yield f"{path.name}:{number}", re.compile(pattern.replace("\\/", "/")), "search"


def example(nodes):
    """Returns a short text that matches."""
    return "".join(_of_node(str(kind), given) for kind, given in nodes)


def _of_node(kind, given):
    if kind == "LITERAL":
        return chr(given)
    if kind in ("NOT_LITERAL", "ANY"):
        return "b"
    if kind == "IN":
        # The parser has no way back to a text, so that letters are tried.
        letters = [*"a0 .x_-:,=/A\"'#()[]{}\t\n<@?&+%", *map(chr, range(33, 0x300))]
        is_in = _matching_one(given)
        return next((each for each in letters if is_in and is_in(each)), "a")
    if kind in _REPEATS:
        return example(given[2]) * given[0]
    if kind == "SUBPATTERN":
        return example(given[-1])
    if kind == "BRANCH":
        return example(given[1][0])
    if kind == "ATOMIC_GROUP":
        return example(given)
    return ""


def _matching_one(given):
    """Returns what matches one letter of a set; None where that is not known."""
    tree = _parser.parse("a")
    tree.data = [(_constants.IN, given)]
    compiler = getattr(re, "_compiler", None) or __import__("sre_compile")
    try:
        return compiler.compile(tree).match
    except TypeError:
        return None


def beginnings(nodes, before=""):
    """Yields texts that lead to each part which may repeat without end."""
    for kind, given in nodes:
        if str(kind) in _REPEATS:
            if given[1] is _constants.MAXREPEAT or given[1] > 1000:
                yield before
            yield from beginnings(given[2], before)
        elif str(kind) == "SUBPATTERN":
            yield from beginnings(given[-1], before)
        elif str(kind) == "BRANCH":
            for each in given[1]:
                yield from beginnings(each, before)
        before += _of_node(str(kind), given)


def is_slow(made, way):
    """Returns whether a text exists that takes more than a processor's time."""
    child = os.fork()
    if child == 0:
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        is_text = isinstance(made.pattern, str)
        pattern = made.pattern if is_text else made.pattern.decode("latin-1")
        parsed = _parser.parse(pattern, made.flags & ~re.UNICODE)
        for before, pump, end in product({"", "x", *beginnings(parsed)}, MORE_PUMPS if SOAK else PUMPS, ENDS):
            for letters, enough in (*FEWER, (LETTERS, 0.0)):
                text = before + pump * (letters // len(pump)) + end
                begun = processor_seconds()
                resource.setrlimit(resource.RLIMIT_CPU, (int(begun) + SECONDS + 1, resource.RLIM_INFINITY))
                match(made, way, text if is_text else text.encode("latin-1", "replace"))
                if processor_seconds() - begun < enough:
                    break
        os._exit(0)
    return os.waitpid(child, 0)[1] != 0


def processor_seconds():
    """Returns the time of a processor that this process has used."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def match(made, way, text):
    """Matches a text, or looks at all of it."""
    if way == "fullmatch":
        made.fullmatch(text)
    else:
        for _ in made.finditer(text):
            """Goes on behind each match."""


if __name__ == "__main__":
    # Trees of all modules stay to the end: to look for what is free takes longer than to make them.
    gc.disable()
    slow = {}
    """True for each expression that is slow: some stand in several places."""
    for place, made, way in chain(of_the_page(), expressions()):
        if place.partition(":")[0] not in sys.argv[1:]:
            if (made, way) not in slow:
                slow[made, way] = is_slow(made, way)
            if slow[made, way]:
                print(f"{place}: {way} {made.pattern!r}", flush=True)
