"""Docstrings below the fields of a class, read from its source where a schema asks for them."""

from __future__ import annotations

import ast
import inspect
import textwrap
from collections.abc import Mapping
from functools import cache
from itertools import pairwise
from types import MappingProxyType


# To find the source of a class, Python parses all of its module.
@cache
def field_docstrings(kind: type) -> Mapping[str, str]:
    """Returns the docstring of each field that has one; none of a class that was made without source."""
    try:
        source = inspect.getsource(kind)
    except (OSError, TypeError):
        return MappingProxyType({})
    (body,) = ast.parse(textwrap.dedent(source)).body
    assert isinstance(body, ast.ClassDef)
    found = {
        field.target.id: inspect.cleandoc(text.value.value)
        for field, text in pairwise(body.body)
        if isinstance(field, ast.AnnAssign)
        and isinstance(field.target, ast.Name)
        and isinstance(text, ast.Expr)
        and isinstance(text.value, ast.Constant)
        and isinstance(text.value.value, str)
    }
    return MappingProxyType(found)
