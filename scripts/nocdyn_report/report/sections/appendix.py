"""The input as text."""

from ..content import Items, Listing, Section
from ..sources import Sources


def input_section(sources: Sources, overrides: list[str]) -> Section:
    section = Section("input", "Input", is_appendix=True)
    section.add(Listing(f"{sources.check['input']}, as it was read", sources.text))
    if overrides:
        section.add(Items([f"--set {one}" for one in overrides]))
    section.add(Listing("Complete input, defaults and tables included", sources.check["complete_input"], is_folded=True))
    return section
