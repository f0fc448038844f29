#!/usr/bin/env python3
"""The form of comments and pages, checked: what a script can see of CONTRIBUTING's "plain English".

- A line with a comment has at most 100 columns. clang-format leaves comments alone (ReflowComments: false), because it
  cannot tell a paragraph from a drawing or a table, and tears them; so this check keeps the width.
- So has a line of a page. What cannot be broken is let be: rows of tables, code, a picture, and a piece without a blank.
- No line of one to three words stands in the middle of a paragraph: it is left over from an earlier wrap.
- No sentence begins with "Who" or "Whoever": such a sentence has no subject until its middle.
- No comment is a phrase that begins with a preposition and has no verb ("For the report."): nobody knows who does what.
- No parameter is introduced by a genitive ("`at`: of its registers"), and nothing "is there": it exists, has come, or is the sketch's.
- No comment (nor its paragraph behind an empty line), docstring or line of a page begins with "Of" and a word in lower case: whose value it is comes
  before what it is, and the reader waits for the subject. What a script writes into a page is its own (`<!-- made by … -->` to `<!-- end … -->`).

Run from anywhere: `tools/check_prose.py`. Prints one line per offence, `file:line: what (what to do)`, and exits 1 if any.
`--self-test` shows that each rule catches an offence made for it.
"""
import re
import sys

sys.dont_write_bytecode = True

import tree_check  # noqa: E402

COLUMNS_MAX = 100
LEFT_OVER_WORDS = 3
LEFT_OVER_COLUMNS = 50

SLASHES = (".h", ".cpp", ".ino", ".ts", ".tsx", ".mjs")
HASHES = (".py", ".sh", ".cmake", "CMakeLists.txt", "run", "test", "install")

DRAWING = re.compile(r"[─│┌┐└┘├┤►◄▲▼═║╪┬┴┼]|\S {2,}\S|^ *[|+^]|---|___|^ {2,}")
BLOCK_COMMENT = re.compile(r"^ *(/\*(?!.*\*/ *\S)|\* )")  # not one with code behind it
ITEM = re.compile(r"^ *([-*]|\d+[.)]) +\S")
TOOLS_WORDS = re.compile(r"\b(NOLINT|clang-format|eslint|shellcheck)")
UNBROKEN = re.compile(r"(`+).+?\1|\]\([^)]*\)")  # code, and the target of a link
OPENING = re.compile(r' *(/\*\*?|\*|""") ?(?=\S)')  # of a block comment's line, or of a docstring
OF_FIRST = re.compile(r"Of [a-z`\[]")
ITEM_OF_FIRST = re.compile(r" *(?:(?:[-*+>]|\d+[.)]) +)?" + OF_FIRST.pattern)
# A comment of a few words that begins with one of these is a phrase, unless it has a verb. VERB
# takes each word for one that may be: it lets some phrases pass, and accuses no sentence.
PREPOSITION = re.compile(r"(Above|After|Among|As|At|Before|Behind|Below|Beside|Between|By|For|From|In|Likewise|On|Over|Through|To|Under|Until|With|Within|"
                         r"Without)\b")
PHRASE_WORDS_MAX = 8
VERB = re.compile(r"\b(is|are|was|were|be|been|has|have|had|do|does|did|can|cannot|may|must|will|would|could|should|might|\w+(?<![sui])s|\w+ed|"
                  r"answer|ask|become|became|begin|began|call|came|change|come|count|draw|drew|drawn|end|fall|fell|find|found|follow|get|give|gave|given|go|"
                  r"gone|got|held|hold|keep|kept|knew|know|known|lay|leave|left|let|lie|made|make|mean|meant|move|need|play|print|put|ran|read|run|said|saw|"
                  r"say|see|seen|send|sent|set|show|shown|stand|stay|stood|take|taken|tell|told|took|turn|use|wait|want|went|write|written|wrote)\b")
PARAMETER_OF = re.compile(r"`\w+`: of (a|all|an|each|its|the)\b")
THAT_IS_THERE = re.compile(r"\bthat (is|are|was|were) there\b")
SENTENCE_OF_WHO = re.compile(r"(?:^|(?<=[.:;!?] ))(Who|Whoever) (?!\S*\?)[^.?]*\.")


def marker_of(path):
    """What begins a comment in this kind of file; None: no file of this check."""
    if path.endswith(SLASHES):
        return "//"
    name = path.rsplit("/", 1)[-1]
    return "#" if path.endswith(HASHES[:4]) or name in HASHES[4:] else None


def comment_of(line, marker):
    """(column, text) of the comment in a line, or None. Strings are passed over; `https://` is not a comment."""
    quote = None
    i = 0
    while i < len(line):
        c = line[i]
        if quote:
            i += 2 if c == "\\" else 1
            quote = None if c == quote else quote
            continue
        number_separator = c == "'" and i > 0 and line[i - 1].isalnum()
        if c in "\"'`" and not number_separator:
            quote = c
        elif line.startswith(marker, i) and (marker == "//" or i == 0 or line[:i].isspace()) and not line.startswith("#!"):
            return i, re.sub(r"^(///<|///|//|#) ?", "", line[i:])
        i += 1
    return None


def blocks(lines, marker):
    """Comments that fill their lines, joined while they stand below one another: [(first line number, [text])]."""
    found = []
    for number, line in enumerate(lines, 1):
        comment = comment_of(line, marker) if line.strip().startswith(marker) else None
        if comment is None:
            continue
        column, text = comment
        if found and found[-1][0] + len(found[-1][2]) == number and found[-1][1] == column:
            found[-1][2].append(text)
        else:
            found.append((number, column, [text]))
    return [(number, texts) for number, _, texts in found]


def beginnings(lines, marker):
    """(line number, text) where a comment or a docstring begins, or a comment goes on behind an empty line of it."""
    for first, texts in blocks(lines, marker):
        yield from ((first + i, text) for i, text in enumerate(texts) if i == 0 or not texts[i - 1].strip())
    before = ""
    for number, line in enumerate(lines, 1):
        beside_code = None if line.strip().startswith(marker) else comment_of(line, marker)
        opening = OPENING.match(line)
        if beside_code:
            yield number, beside_code[1]
        elif opening and (opening[1] != "*" or before in ("/*", "/**", "*")):
            yield number, line[opening.end():]
        before = line.strip()


def is_prose(text):
    return bool(text.strip()) and not DRAWING.search(text) and not TOOLS_WORDS.search(text)


def left_over(texts):
    """Indices of lines of a few words between two lines of prose."""
    for i in range(1, len(texts) - 1):
        few_words = len(texts[i].split()) <= LEFT_OVER_WORDS and len(texts[i]) < LEFT_OVER_COLUMNS
        ends_paragraph = texts[i].rstrip().endswith(":") or ITEM.match(texts[i]) or ITEM.match(texts[i + 1])
        if few_words and not ends_paragraph and all(map(is_prose, texts[i - 1:i + 2])):
            yield i


def is_phrase(words):
    """A whole comment of a few words, without a verb."""
    text = words.strip()
    if not PREPOSITION.match(text) or not text.endswith(".") or ". " in text or len(text.split()) > PHRASE_WORDS_MAX:
        return False
    return not VERB.search(text.partition(" ")[2])


def tics(words):
    """What is wrong with the words of a comment, or of a line of a page."""
    if PARAMETER_OF.search(words):
        yield "a parameter is introduced by Of (say what it is)"
    if THAT_IS_THERE.search(words):
        yield "'that is there' (say that it exists, has come, or whose it is)"


def can_be_broken(line):
    """A line of a page has a blank behind its first word at which it may be broken."""
    whole = UNBROKEN.sub(lambda piece: piece[0].replace(" ", "_"), line)
    marker = re.match(r" *(?:[-*+>]|\d+[.)])? *", whole)[0]
    return " " in whole[len(marker):]


def page_offences(lines):
    is_code = is_made = False
    for number, line in enumerate(lines, 1):
        if line.startswith("<!-- "):
            is_made = line.startswith("<!-- made by ")
        if line.lstrip().startswith("```"):
            is_code = not is_code
        elif not is_code and SENTENCE_OF_WHO.search(line):
            yield number, "a sentence begins with Who (say the subject first)"
        elif not is_code and not is_made and ITEM_OF_FIRST.match(line):
            yield number, "a line begins with Of (say the subject first)"
        if not is_code:
            yield from ((number, what) for what in tics(line))
        if is_code or len(line) <= COLUMNS_MAX or line.lstrip().startswith(("|", "!")):
            continue
        if can_be_broken(line):
            yield number, f"{len(line)} columns of a page (at most {COLUMNS_MAX}: wrap it)"


def offences(path, text):
    lines = text.splitlines()
    if path.endswith(".md"):
        yield from page_offences(lines)
        return
    marker = marker_of(path)
    for number, line in enumerate(lines, 1):
        comment = comment_of(line, marker) or (marker == "//" and BLOCK_COMMENT.match(line))
        if comment and len(line) > COLUMNS_MAX and not TOOLS_WORDS.search(line):
            yield number, f"{len(line)} columns with a comment (at most {COLUMNS_MAX}: wrap it, or put it above the code)"
    for number, words in beginnings(lines, marker):
        if OF_FIRST.match(words):
            yield number, "a comment begins with Of (say the subject first)"
    for first, texts in blocks(lines, marker):
        for i in left_over(texts):
            yield first + i, f"'{texts[i].strip()}' is left over from an earlier wrap (join the paragraph)"
        whole = " ".join(texts)
        yield from ((first, what) for what in tics(whole))
        if is_phrase(whole):
            yield first, f"'{whole.strip()}' has no verb (say who does what)"
        for match in SENTENCE_OF_WHO.finditer(whole):
            yield first, f"'{match[0][:40]} …' begins with Who (say the subject first)"


def self_test():
    long_line = "// " + "a word " * 15
    cases = [
        ("base/a.h", long_line, "columns"),
        ("base/a.h", "int x;  " + long_line, "columns"),
        ("web/ui/src/a.ts", "/** " + "a word " * 15 + "*/", "columns"),
        ("tools/a.py", "# " + "a word " * 15, "columns"),
        ("base/a.h", "// The first line of a paragraph that goes on\n// and on.\n// And then it has another line.\n", "left over"),
        ("base/a.h", "/// Who holds it ranks as the highest.\n", "Who"),
        ("base/a.h", "// It is kept. Whoever comes next\n// reads it.\n", "Who"),
        ("docs/a.md", "Text. Who reads this is lost.\n", "Who"),
        ("base/a.h", "/// Of the processor, in °C.\n", "Of"),
        ("base/a.h", "// A head.\n//\n// Of `a` alone.\n", "Of"),
        ("base/a.h", "int x;  ///< Of the loop.\n", "Of"),
        ("web/ui/src/a.ts", "  /** Of the time. */\n", "Of"),
        ("web/ui/src/a.ts", "/**\n * Of the time.\n */\n", "Of"),
        ("tools/a.py", "# Of a file.\n", "Of"),
        ("tools/a.py", '    """Of a file."""\n', "Of"),
        ("docs/a.md", "Of what failed, this.\n", "Of"),
        ("docs/a.md", "- Of `a` alone.\n", "Of"),
        ("docs/a.md", "<!-- made by a -->\n<!-- end -->\nOf what failed, this.\n", "Of"),
        ("base/a.h", "/// For the guarantee report.\n", "no verb"),
        ("base/a.h", "/// As above.\n", "no verb"),
        ("base/a.h", "/// `at`: of its registers.\n", "introduced by Of"),
        ("base/a.h", "/// Opens a file that is\n/// there.\n", "that is there"),
        ("docs/a.md", "Each class that is there.\n", "that is there"),
        ("docs/a.md", "a word " * 15 + "\n", "columns"),
        ("docs/a.md", "- `" + "a word " * 15 + "` and more\n", "columns"),
    ]
    clean = list(offences("base/a.h", "// A head of one line.\n//\n//   a    drawing\n//   b\n//   c    of it\n//\n// Who? is a question.\n"
                                      "const char* url = \"https://a.b\";\n// It holds\n// Of a word or of none: both.\n"))
    clean += offences("base/a.h", "/**\n * Whole words.\n * Of a sentence's middle.\n */\nint x;  ///< of the loop\n// Of 40 none was late.\n")
    clean += offences("docs/a.md", "<!-- made by a -->\nOf what failed, this.\n<!-- end -->\n```\nOf what failed\n```\n")
    clean += offences("base/a.h", "/// As it was made.\n\n/// In order. Once.\n\n/// At least half of the wait is slept.\n\n/// `at`: the place of it.\n")
    clean += offences("docs/a.md", "| " + "a word " * 15 + "|\n```\n" + "a word " * 15 + "\n```\n- `" + "a word " * 15 + "`\n")
    return tree_check.failed_cases(cases, clean, offences)


if __name__ == "__main__":
    sys.exit(tree_check.run("prose", lambda path: path.endswith(".md") or marker_of(path), offences, self_test))
