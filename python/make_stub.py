#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes what editors and type checkers read of the module tutti, made of its own docstrings: make_stub.py OUT.pyi"""
import inspect
import re
import sys
import textwrap

HEADER = '''"""{doc}"""
import os
import typing

import numpy
import numpy.typing

__version__: str
'''


def in_pythons_words(text):
    """pybind11's types in Python's: List[float] is list[float], numpy.ndarray[numpy.float64] an NDArray."""
    text = re.sub(r"numpy\.ndarray\[(numpy\.\w+|bool)\]", r"numpy.typing.NDArray[\1]", text)
    text = re.sub(r"\bOptional\[", "typing.Optional[", text)
    for name in ("List", "Tuple", "Dict", "Set"):
        text = re.sub(rf"\b{name}\[", name.lower() + "[", text)
    return re.sub(r"\btutti\.(?=[A-Z])", "", text).replace(": buffer", ": typing.Any").replace(": object", ": typing.Any").replace("-> object", "-> typing.Self")


def split_doc(doc):
    """The signature, which pybind11 puts first, and the rest."""
    first, _, rest = (doc or "").strip().partition("\n")
    return in_pythons_words(first), inspect.cleandoc(rest)


def body(doc, indent):
    return textwrap.indent('"""' + doc + '"""', indent, lambda line: line.strip()) if doc else indent + "..."


def function(name, doc, indent="", decorator=""):
    signature, text = split_doc(doc)
    arguments = signature[signature.index("("):]
    if indent and not decorator:
        arguments = re.sub(r"^\(self: [\w.]+", "(self", arguments)
    return f"{decorator and indent + decorator + chr(10)}{indent}def {name}{arguments}:\n{body(text, indent + '    ')}\n"


def property_of(name, value):
    signature, text = split_doc(value.fget.__doc__)
    result = signature.rpartition("->")[2].strip() or "typing.Any"
    text = inspect.cleandoc(value.__doc__ or "") or text
    return f"    @property\n    def {name}(self) -> {result}:\n{body(text, '        ')}\n"


def class_of(name, value):
    parts = [f"class {name}:\n" + body(inspect.cleandoc(value.__doc__ or ""), "    ") + "\n"]
    for key, member in sorted(vars(value).items()):
        if isinstance(member, property):
            parts.append(property_of(key, member))
        elif key in ("__init__", "__len__", "__getitem__", "__iter__", "__next__", "__enter__", "__exit__") or not key.startswith("_"):
            is_static = isinstance(member, staticmethod)
            doc = (member.__func__ if is_static else member).__doc__
            if f"{key}(" in (doc or "").partition("\n")[0]:  # written in C++
                parts.append(function(key, doc, "    ", "@staticmethod" if is_static else ""))
    return "\n".join(parts)


def stub(module):
    out = [HEADER.format(doc=module.__doc__.rstrip() + "\n")]
    for name in module.__all__:
        value = getattr(module, name)
        out.append(class_of(name, value) if inspect.isclass(value) else function(name, value.__doc__))
    return "\n\n".join(out)


if __name__ == "__main__":
    sys.path.pop(0)  # the tutti of this folder is without its module
    import tutti

    with open(sys.argv[1], "w", encoding="utf-8") as file:
        file.write(stub(tutti))
