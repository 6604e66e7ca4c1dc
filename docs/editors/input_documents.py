"""Inputs of nocdyn as documents of its JSON Schema: checked, and converted between namelists, JSON and YAML.

usage: input_documents.py check FILE...      are the files valid by the schema of `nocdyn help input --json`?
       input_documents.py json FILE          the input as JSON
       input_documents.py namelist FILE      the input as a namelist, which nocdyn reads

A file ends in .json, .yaml or .yml; all others are namelists. Needs f90nml, jsonschema to check, PyYAML for YAML.
Exit codes: 0 done, 1 a file is not valid.
"""

import json
import subprocess
import sys
from pathlib import Path

import f90nml


def input_schema(nocdyn="nocdyn"):
    """The JSON Schema of the program."""
    return json.loads(subprocess.run([nocdyn, "help", "input", "--json"], check=True, capture_output=True, text=True).stdout)


def namelist_document(text, schema):
    """A namelist as a document: a group that may repeat is a list of objects, another one an object."""
    groups = {}
    for name, group in f90nml.reads(text).items():
        keys = {key: value for key, value in group.todict().items() if key != "_start_index"}
        groups.setdefault(name, []).append(keys)
    lists = {name for name, rule in schema["properties"].items() if rule["type"] == "array"}
    return {name: found if name in lists or len(found) > 1 else found[0] for name, found in groups.items()}


def read_document(path, schema):
    """The document in a file."""
    text = Path(path).read_text(encoding="utf-8")
    match Path(path).suffix:
        case ".json":
            return json.loads(text)
        case ".yaml" | ".yml":
            import yaml  # which only those need who write YAML

            return yaml.safe_load(text)
        case _:
            return namelist_document(text, schema)


def namelist_text(document):
    """A document as a namelist."""

    def literal(value):
        match value:
            case bool():
                return ".true." if value else ".false."
            case str():
                return "'" + value.replace("'", "''") + "'"
            case list():
                return ", ".join(map(literal, value))
        return repr(value)

    groups = [(name, keys) for name, found in document.items() for keys in (found if isinstance(found, list) else [found])]
    return "".join(
        " ".join([f"&{name}", *(f"{key} = {literal(value)}" for key, value in keys.items()), "/\n"]) for name, keys in groups
    )


def mistakes(document, schema):
    """A sentence for each mistake: the group, the name of its element, the key and what is wrong."""
    from jsonschema import Draft202012Validator  # which converting does not need

    for error in sorted(
        Draft202012Validator(schema).iter_errors(document), key=lambda error: list(map(str, error.absolute_path))
    ):
        place, element = "", document
        for step in error.absolute_path:
            element = element[step]
            if isinstance(step, int) and isinstance(element, dict):
                place += f" '{element['name']}'" if "name" in element else f" number {step + 1}"
            else:
                place += f" {step}" if place else f"&{step}"
        yield f"{place or 'the input'}: {error.message}"


def main(command, *paths):
    schema = input_schema()
    status = 0
    for path in paths:
        document = read_document(path, schema)
        if command == "check":
            found = list(mistakes(document, schema))
            print("\n".join(f"{path}: {mistake}" for mistake in found) or f"{path}: valid")
            status = max(status, int(bool(found)))
        else:
            print(
                {"json": lambda one: json.dumps(one, indent=2), "namelist": lambda one: namelist_text(one).rstrip()}[command](
                    document
                )
            )
    return status


if __name__ == "__main__":
    if len(sys.argv) < 3 or sys.argv[1] not in ("check", "json", "namelist"):
        sys.exit(__doc__)
    sys.exit(main(*sys.argv[1:]))
