"""Files that let editors complete groups and keys of inputs, made of the schema of `nocdyn help input --json`.

usage: completions.py vscode|vim

  vscode  .vscode/nocdyn.code-snippets: a snippet for each group, with the keys that it must have; their menu shows what they are
  vim     nocdyn.dict: the groups and keys, for `set dictionary`

The file is printed.
"""

import itertools
import json
import sys

from input_documents import input_schema


def keys_of(group):
    """The keys of a group, and those that it must have."""
    found = group if "properties" in group else group["items"]
    return found["properties"], found.get("required", [])


def snippet(name, group):
    """The group with places to fill in, one for each value that it must have."""
    properties, required = keys_of(group)
    places = itertools.count(1)

    def place(rule):
        if rule.get("type") == "array":
            return ", ".join(place(rule["items"]) for _ in range(rule.get("minItems", 1)))
        word = f"${{{next(places)}|{','.join(rule['enum'])}|}}" if "enum" in rule else f"${next(places)}"
        return f"'{word}'" if rule.get("type") == "string" else word

    keys = dict.fromkeys((["name"] if "name" in properties else []) + required)
    body = " ".join([f"&{name}", *(f"{key} = {place(properties[key])}" for key in keys), "$0 /"])
    return {"prefix": f"&{name}", "description": group["description"], "body": body}


def main(editor):
    groups = input_schema()["properties"]
    if editor == "vscode":
        print(json.dumps({f"&{name}": snippet(name, group) for name, group in groups.items()}, indent=2))
    else:
        print(
            "\n".join(
                sorted({*(f"&{name}" for name in groups), *(key for group in groups.values() for key in keys_of(group)[0])})
            )
        )


if __name__ == "__main__":
    if sys.argv[1:] not in (["vscode"], ["vim"]):
        sys.exit(__doc__)
    main(sys.argv[1])
