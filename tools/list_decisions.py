#!/usr/bin/env python3
"""Writes the index of docs/decisions.md: each decision below its subject, with a link.

    tools/list_decisions.py            writes it anew
    tools/list_decisions.py --check    names the first line that is not as it would be written, and ends with 1

A reader looks for a reason by its subject, and 240 headings are too many to leaf through. An index that is written by hand
lacks the last ones.
"""
import pathlib
import re
import sys
import textwrap

PAGE = pathlib.Path(__file__).resolve().parents[1] / "docs" / "decisions.md"
BEGIN, END = "<!-- index -->\n", "<!-- end of index -->\n"
COLUMNS = 100


def anchor_of(heading, taken):
    """As GitHub makes it of a heading; the second of one name gets a number."""
    anchor = re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")
    number = taken[anchor] = taken.get(anchor, -1) + 1
    return anchor if number == 0 else f"{anchor}-{number}"


def index_of(text):
    lines, taken = [], {}
    for marks, heading in re.findall(r"^(##?#?) (.+)$", text, re.M):
        link = f"[{heading}](#{anchor_of(heading, taken)})"
        if marks == "##":
            lines += ["", f"**{link}**", ""]
        elif marks == "###":
            lines += textwrap.wrap(f"- {link}", COLUMNS, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False)
    return "\n".join(lines[1:]) + "\n"


def with_index(text):
    before, rest = text.split(BEGIN)
    after = rest.split(END)[1]
    return before + BEGIN + index_of(before + after) + END + after


def main(arguments):
    text = PAGE.read_text(encoding="utf-8")
    wanted = with_index(text)
    if arguments != ["--check"]:
        PAGE.write_text(wanted, encoding="utf-8")
        return 0
    for number, (is_there, should_be) in enumerate(zip(text.splitlines(), wanted.splitlines()), 1):
        if is_there != should_be:
            print(f"docs/decisions.md:{number}: should be: {should_be} (write it anew: tools/list_decisions.py)")
            return 1
    return 0 if len(text) == len(wanted) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
