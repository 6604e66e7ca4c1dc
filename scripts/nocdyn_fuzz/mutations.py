"""One change of a file: bits, tokens, repeats, extreme numbers, groups, rows of tables."""

import re

from .corpus import GROUP, KEY, QUOTED

NUMBER = re.compile(rb"(?<![\w.])[-+]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][-+]?\d+)?(?![\w.])")
NUMBERS_OF_KEYS = re.compile(rb"(?:=|,)\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][-+]?\d+)?)(?![\w.])")
TOKEN = re.compile(rb"'[^'\n]*'|[-+]?[\w.]+|[^\s\w]")

# The first of them are in the range of most keys.
EXTREME = (
    b"1e308 1.7e308 1.7976931348623157e308 1e-308 2.2250738585072014e-308 1e-310 4.9e-324 1e-200 1e200 1e155 1e-155 "
    b"1e103 1e-103 1e100 1e-100 1e30 1e-30 1e16 1e-16 1e9 1e6 0 1 2 -0.0 -1e308 -4.9e-324 -1e200 -1 2147483647 "
    b"2147483648 -2147483648 4294967296 1e309 9223372036854775807 9223372036854775808 1e999999999 nan NaN(1) inf "
    b"-Infinity 0x10 1d0 1e 1e+ .5 5. . + - 1,5 1_8 1/0 3*1.0 0*1 100000*0.5 2000000000*1 99999999999*2 3* .true. T "
    b"'a' '' \"b\" (1,2)"
).split(b" ")
IN_RANGE = 24
FACTORS = (0.0, -1.0, 0.5, 2.0, 1e-3, 1e3, 1e-6, 1e6, 1e-12, 1e12, 1e-50, 1e50, 1e-150, 1e150, 1e-300, 1e300, 1.0 + 2.0**-52)
ODD_BYTES = (
    b"\0", b"\t", b"\r", b"\r\n", b"\n", b"\x07", b"\x08", b"\x1b[31m", b"\x1b]0;t\x07", b"\x7f", b"\x80", b"\xff\xfe",
    b"\xc2\x9b", b"\xe2\x80\xae",
    b"\xe2\x80\xa8", b"\xef\xbb\xbf", b"\xed\xa0\x80", b"\xf4\x90\x80\x80", "ä".encode(), "語".encode(), "😀".encode(),
    "é".encode() * 60, b"\xc3",
    b"'", b'"', b"!", b"/", b"&", b"$", b"=", b",", b"*", b"(", b")", b"%", b"\\", b"''", b"&end", b"&end\n", b";", b"#",
)  # fmt: skip


def span(rng, content, longest):
    """Ends of a random piece."""
    start = rng.randrange(len(content) + 1)
    return start, min(len(content), start + rng.randint(0, longest))


def pick(rng, pattern, content):
    found = list(pattern.finditer(content))
    return rng.choice(found) if found else None


def extreme(rng):
    return rng.choice(EXTREME[:IN_RANGE] if rng.random() < 0.75 else EXTREME)


def replaced(content, match, new, group=0):
    return content[: match.start(group)] + new + content[match.end(group) :]


# Each of these takes a random generator, a content and the corpus, and returns the changed content.


def flip_bits(rng, content, _):
    changed = bytearray(content)
    for _ in range(rng.choice((1, 1, 2, 8))):
        if changed:
            changed[rng.randrange(len(changed))] ^= 1 << rng.randrange(8)
    return bytes(changed)


def insert_bytes(rng, content, _):
    at = rng.randrange(len(content) + 1)
    return content[:at] + rng.choice(ODD_BYTES) * rng.choice((1, 1, 1, 3)) + content[at:]


def insert_odd_into_text(rng, content, corpus):
    match = pick(rng, QUOTED, content)
    if not match:
        return insert_bytes(rng, content, corpus)
    at = rng.randint(match.start() + 1, match.end() - 1)
    return content[:at] + rng.choice(ODD_BYTES) + content[at:]


def cut(rng, content, _):
    start, end = span(rng, content, rng.choice((1, 10, 100, 10000)))
    return content[:start] + content[end:]


def truncate(rng, content, _):
    return content[: rng.randrange(len(content) + 1)]


def repeat(rng, content, _):
    start, end = span(rng, content, rng.choice((1, 10, 100)))
    return content[:end] + content[start:end] * rng.choice((1, 2, 10, 100, 1000)) + content[end:]


def extreme_number(rng, content, corpus):
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        match = pick(rng, NUMBERS_OF_KEYS, content)
        if not match:
            return extreme_cell(rng, content, corpus)
        content = replaced(content, match, extreme(rng), 1)
    return content


def extreme_cell(rng, content, _):
    match = pick(rng, NUMBER, content)
    return replaced(content, match, extreme(rng)) if match else content


def scaled_numbers(rng, content, _):
    for _ in range(rng.choice((1, 1, 2, 4))):
        match = pick(rng, NUMBERS_OF_KEYS, content) or pick(rng, NUMBER, content)
        if not match:
            return content
        group = match.re.groups
        value = float(match[group].lower().replace(b"d", b"e"))
        content = replaced(content, match, repr(value * rng.choice(FACTORS)).encode(), group)
    return content


def same_extreme_everywhere(rng, content, _):
    """All numbers of one key."""
    key = pick(rng, KEY, content)
    if not key:
        return content
    value = extreme(rng)
    pattern = re.compile(rb"(\b" + key[1] + rb"\s*=\s*)[-+]?[\d.]+(?:[eE][-+]?\d+)?")
    return pattern.sub(lambda match: match[1] + value, content)


def swap_tokens(rng, content, _):
    one, other = pick(rng, TOKEN, content), pick(rng, TOKEN, content)
    if not one or one.start() == other.start():
        return content
    first, second = sorted((one, other), key=lambda match: match.start())
    return content[: first.start()] + second[0] + content[first.end() : second.start()] + first[0] + content[second.end() :]


def drop_token(rng, content, _):
    match = pick(rng, TOKEN, content)
    return replaced(content, match, b"") if match else content


def repeat_token(rng, content, _):
    match = pick(rng, TOKEN, content)
    count = rng.choice((2, 3, 10, 1000))
    return replaced(content, match, rng.choice((b", ", b" ", b"")).join([match[0]] * count)) if match else content


def other_text(rng, content, corpus):
    match = pick(rng, QUOTED, content)
    return replaced(content, match, rng.choice(corpus.texts)) if match else content


def long_text(rng, content, _):
    match = pick(rng, QUOTED, content)
    word = rng.choice((b"x", b"'' ", "ä".encode(), "語".encode(), b"a b "))
    return replaced(content, match, b"'" + word * rng.choice((40, 81, 1000, 50000)) + b"'") if match else content


def other_key(rng, content, corpus):
    match = pick(rng, KEY, content)
    return replaced(content, match, rng.choice(corpus.keys), 1) if match else content


def new_setting(rng, content, corpus):
    match = pick(rng, GROUP, content)
    if not match:
        return content
    at = match.end() - 1
    added = b" ".join(rng.choice(corpus.settings) for _ in range(rng.choice((1, 1, 2))))
    return content[:at] + b" " + added + b" " + content[at:]


def drop_group(rng, content, _):
    match = pick(rng, GROUP, content)
    return replaced(content, match, b"") if match else content


def double_group(rng, content, _):
    match = pick(rng, GROUP, content)
    return content + b"\n" + match[0] * rng.choice((1, 1, 5)) + b"\n" if match else content


def copies_of_group(rng, content, _):
    """Many elements, each with a name of its own."""
    match = pick(rng, GROUP, content)
    if not match:
        return content
    count = rng.choice((2, 10, 100))
    copies = [re.sub(rb"(\bname\s*=\s*')", rb"\g<1>" + f"n{number}".encode(), match[0]) for number in range(count)]
    return content + b"\n" + b"\n".join(copies) + b"\n"


def swap_groups(rng, content, _):
    found = list(GROUP.finditer(content))
    if len(found) < 2:
        return content
    first, second = sorted(rng.sample(found, 2), key=lambda match: match.start())
    return content[: first.start()] + second[0] + content[first.end() : second.start()] + first[0] + content[second.end() :]


def splice_group(rng, content, corpus):
    """A group of another input, whose bodies become those of this one."""
    names = re.findall(rb"&body[^/]*?name\s*=\s*('[^'\n]*')", content)
    group = rng.choice(corpus.groups)
    if names and rng.random() < 0.8:
        group = re.sub(
            rb"(\b(?:body|bodies|sides|case|carrier|sun|ring)\s*=\s*)'[^'\n]*'", lambda m: m[1] + rng.choice(names), group
        )
        group = re.sub(rb"(\bbodies\s*=\s*'[^'\n]*'\s*,?\s*)'[^'\n]*'", lambda m: m[1] + rng.choice(names), group)
    return content + b"\n" + group + b"\n"


def replace_group(rng, content, corpus):
    match = pick(rng, GROUP, content)
    return replaced(content, match, rng.choice(corpus.groups)) if match else content


def splice_input(rng, content, corpus):
    other = rng.choice(corpus.cases)
    text = other.files[other.main]
    at = rng.randrange(len(text) + 1)
    return content[: rng.randrange(len(content) + 1)] + text[at:]


def shuffle_rows(rng, content, _):
    rows = content.splitlines(keepends=True)
    change = rng.choice(("reverse", "shuffle", "double", "drop", "empty", "many"))
    at = rng.randrange(len(rows)) if rows else 0
    if change == "reverse":
        rows.reverse()
    elif change == "shuffle":
        rng.shuffle(rows)
    elif change == "many":
        rows += rows[at : at + 1] * 2000
    else:
        rows[at : at + 1] = {"double": rows[at : at + 1] * 2, "drop": [], "empty": [b"\n"] * 3}[change]
    return b"".join(rows)


# with how often each is chosen
OF_INPUTS = {
    extreme_number: 40, scaled_numbers: 14, same_extreme_everywhere: 4, flip_bits: 5, insert_bytes: 4,
    insert_odd_into_text: 3, cut: 3, truncate: 2,
    repeat: 3, swap_tokens: 4, drop_token: 4, repeat_token: 2, other_text: 6, long_text: 1, other_key: 4, new_setting: 8,
    drop_group: 3,
    double_group: 2, copies_of_group: 2, swap_groups: 1, splice_group: 7, replace_group: 2, splice_input: 2,
}  # fmt: skip
OF_TABLES = {
    extreme_cell: 10,
    scaled_numbers: 3,
    shuffle_rows: 5,
    flip_bits: 3,
    insert_bytes: 3,
    cut: 2,
    truncate: 1,
    repeat: 2,
    swap_tokens: 2,
}


def mutate_file(rng, case, corpus):
    """One change of one of its files."""
    others = [name for name in case.files if name != case.main]
    name = rng.choice(others) if others and rng.random() < 0.3 else case.main
    table = OF_TABLES if name != case.main else OF_INPUTS
    change = rng.choices(list(table), weights=list(table.values()))[0]
    return case.with_file(name, change(rng, case.files[name], corpus)[:2_000_000], f"{name}: {change.__name__}")
