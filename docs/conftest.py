"""Run every Python block of every page as a test."""

import sys
from types import ModuleType

from sybil import Sybil
from sybil.evaluators.doctest import NUMBER
from sybil.parsers.markdown import PythonCodeBlockParser, SkipParser


class Page(ModuleType):
    """The names of one page as a module, so that the classes written there pickle."""

    def __init__(self, names):
        super().__init__("page")
        self._names = names

    def __getattr__(self, name):
        try:
            return self._names[name]
        except KeyError:
            raise AttributeError(name) from None


def open_page(names):
    """Give a page its module before its first block runs."""
    sys.modules["page"] = Page(names)
    names["__name__"] = "page"


pytest_collect_file = Sybil(
    parsers=[PythonCodeBlockParser(doctest_optionflags=NUMBER), SkipParser()],
    patterns=["*.md"],
    setup=open_page,
).pytest()
