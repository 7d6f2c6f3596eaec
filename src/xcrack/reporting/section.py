"""A part of a report: HTML for readers, numbers for programs."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from xcrack.markup import Markup


@dataclass(frozen=True)
class Section:
    """A part of a report.

    Attributes
    ----------
    key : str
        Its name in the json file, and the anchor of the page.
    title : str
    content : Markup
    numbers : mapping
        What the json file has of it.
    """

    key: str
    title: str
    content: Markup
    numbers: Mapping[str, Any] = field(default_factory=dict)


__all__ = ["Section"]
