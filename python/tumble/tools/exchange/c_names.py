"""Names that a constant of C or C++ must not bear."""

from __future__ import annotations

import re
from typing import Final

_KEYWORDS: Final = frozenset(
    {
        "alignas", "alignof", "and", "and_eq", "asm", "auto", "bitand", "bitor", "bool", "break",
        "case", "catch", "char", "class", "co_await", "co_return", "co_yield", "compl", "concept",
        "const", "const_cast", "consteval", "constexpr", "constinit", "continue", "decltype", "default",
        "delete", "do", "double", "dynamic_cast", "else", "enum", "explicit", "export", "extern",
        "false", "float", "for", "friend", "goto", "if", "inline", "int", "long", "mutable",
        "namespace", "new", "noexcept", "not", "not_eq", "nullptr", "operator", "or", "or_eq",
        "private", "protected", "public", "register", "reinterpret_cast", "requires", "restrict",
        "return", "short", "signed", "sizeof", "static", "static_assert", "static_cast", "struct",
        "switch", "template", "this", "thread_local", "throw", "true", "try", "typedef", "typeid",
        "typename", "typeof", "typeof_unqual", "union", "unsigned", "using", "virtual", "void",
        "volatile", "while", "xor", "xor_eq",
    }
)  # fmt: skip
"""Keywords of C23 and C++23."""
_OTHERS: Final = frozenset({"main", "std", "NULL", "linux", "unix", "i386", "noreturn"})
"""A function that programs have, a namespace, and macros of compilers and of headers."""
_PATTERNS: Final = re.compile(
    r"_[A-Z_]\w*|\w*__\w*"  # of the implementation
    r"|tumble\w*|TUMBLE\w*"  # of tumble.h
    r"|\w+_t|U?INT\w*|(SIZE|PTRDIFF|WCHAR|WINT|SIG_ATOMIC)_\w+"  # of stdint.h and its like
)


def is_reserved(name: str) -> bool:
    """Returns True for a keyword, and for names of the language, of its headers and of `tumble.h`."""
    return name in _KEYWORDS or name in _OTHERS or _PATTERNS.fullmatch(name) is not None
