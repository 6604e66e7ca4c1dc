"""Units for co-simulation (FMUs) by FMI 2.0 and 3.0: an archive of modelDescription.xml, the library, and the whole input."""

import argparse
import platform
import re
import subprocess
import sys
import uuid
import zipfile
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from nocdyn import _find
from nocdyn._errors import NocdynError
from nocdyn._input import Written, as_input
from nocdyn._machine import Machine, release

FMI_2, FMI_3 = 2, 3
_FOLDERS = {FMI_2: {"x86_64": "linux64"}, FMI_3: {}}  # of the library; elsewhere the processor and -linux, as FMI 3.0 has it
_BASE_UNITS = {  # exponents of the base units of FMI, and what one of it is of these
    "kg": ({"kg": 1}, 1.0),
    "m": ({"m": 1}, 1.0),
    "s": ({"s": 1}, 1.0),
    "h": ({"s": 1}, 3600.0),
    "A": ({"A": 1}, 1.0),
    "N": ({"kg": 1, "m": 1, "s": -2}, 1.0),
    "Pa": ({"kg": 1, "m": -1, "s": -2}, 1.0),
    "J": ({"kg": 1, "m": 2, "s": -2}, 1.0),
    "W": ({"kg": 1, "m": 2, "s": -3}, 1.0),
    "V": ({"kg": 1, "m": 2, "s": -3, "A": -1}, 1.0),
    "Ohm": ({"kg": 1, "m": 2, "s": -3, "A": -2}, 1.0),
    "H": ({"kg": 1, "m": 2, "s": -2, "A": -2}, 1.0),
    "rad": ({"rad": 1}, 1.0),
    "deg": ({"rad": 1}, 0.017453292519943295),
    "rpm": ({"rad": 1, "s": -1}, 0.10471975511965977),
    "Hz": ({"rad": 1, "s": -1}, 6.283185307179586),  # of speeds
    "1": ({}, 1.0),
}
_FACTOR = re.compile(r"([A-Za-z]+|1)(\d*)")
_STRUCTURED = re.compile(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)*", re.ASCII)  # a name that FMI parts at its dots
_KINDS = {"at start": "fixed", "in motion": "tunable", "by torque": "torque", "as set point": "set_point"}
_INPUTS = ("torque", "set_point")
_LIBRARY = re.compile(r"^\s*(\S+) => (/\S+)", re.MULTILINE)  # a line of ldd
_OF_GLIBC = re.compile(r"(ld-linux.*|lib(c|m|mvec|dl|rt|pthread|resolv|util|anl))\.so\.\d+")
_LICENSE = """\
The library of this unit is nocdyn, Copyright (c) 2026 The nocdyn authors, under the MIT License. It contains LAPACK and BLAS,
under the modified BSD license: https://netlib.org/lapack
The libraries beside it are of GCC, https://gcc.gnu.org: libgfortran, libgomp, libstdc++ and libgcc_s under the GNU General
Public License, version 3, with the GCC Runtime Library Exception, version 3.1; libquadmath under the GNU Lesser General Public
License, version 2.1.
"""
_EPOCH = (1980, 1, 1, 0, 0, 0)  # of the files of the archive: the same machine gives the same archive


def fmu(given, out=None, fmi=FMI_2, set=None, case=None):  # noqa: A002, the word of the command line
    """Writes a machine as a unit for co-simulation by FMI 2.0 or 3.0; returns the path of the file.

    `given` is a path, the text of an input or an `Input`, `set` has settings, `case` is a load case of it; `out` is the file that
    is written, by default the name of the input with the ending .fmu, in the present folder.
    """
    source = as_input(given, set)
    name = "_".join([Path(source.name).stem, *([case] if case else [])])
    path = Path(out or f"{name}.fmu")
    identifier = re.sub(r"\W", "_", path.stem, flags=re.ASCII)
    identifier = identifier if re.match("[A-Za-z]", identifier) else f"m_{identifier}"  # a name of C
    with Machine(source, case=case) as machine:
        text, variables = machine.input, _variables(machine)
        description = _description(machine, text, variables, name, identifier, fmi)
    lines = [f"{kind}\t{path}\t{value!r}\n" for kind, path, value in (variable[:3] for variable in variables)]
    content = "".join([release(), text, *lines, ElementTree.tostring(description, "unicode")])
    token = f"{{{uuid.uuid5(uuid.NAMESPACE_URL, content)}}}"  # a fingerprint
    description.set("guid" if fmi == FMI_2 else "instantiationToken", token)
    ElementTree.indent(description)
    processor = platform.machine()
    folder = _FOLDERS[fmi].get(processor, f"{processor}-linux")
    files = {
        "modelDescription.xml": ElementTree.tostring(description, "utf-8", xml_declaration=True),
        "resources/machine.nml": text.encode(),
        "resources/variables.txt": "".join([f"{token}\n", *lines]).encode(),
        f"binaries/{folder}/{identifier}.so": Path(_find.library()).read_bytes(),
        "documentation/licenses/license.txt": _LICENSE.encode(),
    }
    files |= {f"binaries/{folder}/{needed}": file.read_bytes() for needed, file in _libraries(_find.library())}
    _write(path, files)
    return path


def _variables(machine):
    """Inputs and parameters: kind, path, value, name, unit, caption."""
    variables = []
    for path, number in machine.numbers.items():
        kind, name, caption = _KINDS[number["change"]], path, number["caption"]
        if kind == "torque":
            name = path.removesuffix("amplitude") + "torque"
            caption = f"torque of {path.removesuffix('.amplitude').replace('.', ' ', 1)}"
        variables.append((kind, path, number["value"], name, number["unit"], caption))
    return variables


def _description(machine, text, variables, name, identifier, fmi):
    """The root of modelDescription.xml, without its token."""
    outputs = list(machine.signals.values())[1:]  # the first one is the time
    is_structured = all(_STRUCTURED.fullmatch(one) for one in [o["name"] for o in outputs] + [v[3] for v in variables])
    root = Element("fmiModelDescription", fmiVersion=f"{fmi}.0", modelName=name, generationTool=f"nocdyn {release()}")
    root.set("description", _value_of(text, "case", "title").strip("'").replace("''", "'") or f"Machine of {name}")
    root.set("variableNamingConvention", "structured" if is_structured else "flat")
    flags = {"modelIdentifier": identifier, "canHandleVariableCommunicationStepSize": "true"}
    if fmi == FMI_2:
        flags |= {"canInterpolateInputs": "true", "canGetAndSetFMUstate": "true", "canNotUseMemoryManagementFunctions": "true"}
    else:
        flags |= {"canGetAndSetFMUState": "true"}
    SubElement(root, "CoSimulation", flags)
    units = {"s", *(output["unit"] for output in outputs), *(variable[4] for variable in variables)} - {""}
    definitions = SubElement(root, "UnitDefinitions")
    for unit in sorted(units):
        _define_unit(SubElement(definitions, "Unit", name=unit), unit)
    categories = SubElement(root, "LogCategories")
    SubElement(categories, "Category", name="logStatusError", description="why a call has failed")
    SubElement(categories, "Category", name="notes", description="what a run of the machine prints before it begins")
    experiment = {
        "startTime": repr(machine.time),
        "stopTime": repr(machine.end_time),
        "tolerance": _value_of(text, "run", "rtol"),
    }
    SubElement(root, "DefaultExperiment", experiment)
    rows = [("time", "s", "time", {"causality": "independent", "variability": "continuous"}, None)]
    of_output = {"causality": "output", "variability": "continuous", "initial": "calculated"}
    rows += [(output["name"], output["unit"], _caption(output), of_output, None) for output in outputs]
    for kind, _, value, variable, unit, caption in variables:
        causality = {"causality": "parameter", "variability": kind, "initial": "exact"}
        if kind in _INPUTS:
            causality = {"causality": "input", "variability": "continuous"}
        rows.append((variable, unit, caption, causality, value))
    _describe_variables(root, rows, range(1, 1 + len(outputs)), fmi)
    return root


def _describe_variables(root, rows, outputs, fmi):
    """ModelVariables and ModelStructure; the place of a variable is its value reference."""
    listed = SubElement(root, "ModelVariables")
    for reference, (name, unit, caption, causality, start) in enumerate(rows):
        common = {"name": name, "valueReference": str(reference)} | causality | {"description": caption}
        of_type = ({"unit": unit} if unit else {}) | ({} if start is None else {"start": repr(start)})
        if fmi == FMI_2:
            SubElement(SubElement(listed, "ScalarVariable", common), "Real", of_type)
        else:
            SubElement(listed, "Float64", common | of_type)
    structure = SubElement(root, "ModelStructure")
    if fmi == FMI_2:
        for group in ("Outputs", "InitialUnknowns"):
            parent = SubElement(structure, group)
            for reference in outputs:
                SubElement(parent, "Unknown", index=str(reference + 1))  # numbered from 1
    else:
        for element in ("Output", "InitialUnknown"):
            for reference in outputs:
                SubElement(structure, element, valueReference=str(reference))


def _caption(signal):
    """What a signal is, of which element, and when it is positive."""
    parts = [signal["caption"], f"{signal['kind']} {signal['element']}".strip()]
    return ", ".join(filter(None, [*parts, signal["positive"] and f"positive {signal['positive']}"]))


def _libraries(library):
    """The shared libraries that a library needs, but those of glibc: names and files."""
    needed = subprocess.run(["ldd", library], check=True, capture_output=True, text=True).stdout
    return [(name, Path(file)) for name, file in _LIBRARY.findall(needed) if not _OF_GLIBC.fullmatch(name)]


def _define_unit(element, unit):
    """The base units of a product of units; what is no such product has none."""
    exponents, factor = {}, 1.0
    above, _, below = unit.partition("/")
    for part, sign in ((above, 1), (below, -1)):
        for word in part.split():
            match = _FACTOR.fullmatch(word)
            if match is None or match[1] not in _BASE_UNITS:
                return
            power = sign * int(match[2] or 1)
            bases, of_base = _BASE_UNITS[match[1]]
            factor *= of_base**power
            for base, exponent in bases.items():
                exponents[base] = exponents.get(base, 0) + power * exponent
    attributes = {base: str(exponent) for base, exponent in exponents.items() if exponent}
    SubElement(element, "BaseUnit", attributes | ({} if factor == 1.0 else {"factor": repr(factor)}))


def _value_of(text, group, key):
    """The value of a key of a group as the text of a whole input has it, '' if it has none."""
    found = re.search(rf"^&{group}\n(?:  .*\n)*?  {key} = (.*)$", text, re.MULTILINE)
    return found[1] if found else ""


def _write(path, files):
    """Writes an archive that appears whole or not at all."""
    partial = path.with_name(f".{path.name}.partial")
    try:
        with zipfile.ZipFile(partial, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, content in files.items():
                entry = zipfile.ZipInfo(name, _EPOCH)
                entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
                archive.writestr(entry, content)
        partial.replace(path)
    except OSError as error:
        raise NocdynError(f"'{path}' cannot be written: {error.strerror}", 3) from None
    finally:
        partial.unlink(missing_ok=True)


def main(words):
    """The command: nocdyn fmu FILE."""
    parser = argparse.ArgumentParser(prog="nocdyn fmu", description="Writes a machine as a unit for co-simulation (FMU).")
    parser.add_argument("file", metavar="FILE", help="input file")
    parser.add_argument("--out", metavar="FILE", help="file that is written; default: the name of the input with .fmu, here")
    parser.add_argument("--fmi", type=int, choices=(FMI_2, FMI_3), default=FMI_2, help="version of FMI, 2.0 or 3.0; default: 2")
    parser.add_argument("--set", metavar="PATH=VALUE", action="append", default=[], help="override a key, as of nocdyn run")
    parser.add_argument("--case", metavar="NAME", help="the machine of this &load_case")
    given = parser.parse_args(words)
    settings = {}
    for word in given.set:
        setting, equals, value = word.partition("=")
        if not equals:
            parser.error(f"--set needs PATH=VALUE; here '{word}'")
        settings[setting] = Written(value)
    try:
        path = fmu(Path(given.file), given.out, given.fmi, settings, given.case)
    except NocdynError as error:
        print(*(f"nocdyn: {line}" for line in str(error).splitlines()), sep="\n", file=sys.stderr)
        return error.code
    except FileNotFoundError as error:
        print(f"nocdyn: {error}", file=sys.stderr)
        return 3
    if given.case is None and re.search(r"^\s*&load_case\b", Path(given.file).read_text(errors="replace"), re.MULTILINE):
        print(f"{given.file}: note: the machine by itself, without its load cases; --case NAME takes one")
    print(f"{path}: FMI {given.fmi}.0, co-simulation")
    return 0
