"""The pictures of check, sim and trace, read with Python's XML parser: what is drawn is what the loops asked for, got and missed."""

import os
import pathlib
import re
import stat
import sys
import unittest
import xml.etree.ElementTree as ElementTree

from sketch_case import SketchCase

TREE = pathlib.Path(__file__).resolve().parents[3]
SVG = "{http://www.w3.org/2000/svg}"

# The bars can be counted by hand. In 200 ms, loop 1 gets its 30 ms, wants more, waits for the next
# budget and so misses a period; loop 3 runs 3 ms in every 10; loop 4 has core 1 for itself.
GOLDEN = """
void setup() {}
void loop(1, 30, 100, 0) { delayBusyMicroseconds(95000); waitForNextPeriod(); }
void loop(3, 4, 10, 0) { delayBusyMicroseconds(3000); waitForNextPeriod(); }
void loop(4, 1, 1, 1) { delayBusyMicroseconds(1000); }
"""
LATE = "void loop(2, 5, 20, 0) { delayBusyMicroseconds(21000); waitForNextPeriod(); }\n"


class Page:
    """The bars of a page, in ms: {(core, vcpu): {kind: sum}}."""

    def __init__(self, path):
        self.root = ElementTree.parse(path).getroot()
        scale = (int(self.root.get("data-until-ns")) - int(self.root.get("data-from-ns"))) / float(self.root.get("data-width")) / 1e6
        self.length_ms = (int(self.root.get("data-until-ns")) - int(self.root.get("data-from-ns"))) / 1e6
        self.bars, self.missed, self.releases = {}, {}, {}
        for group in self.root.iter(SVG + "g"):
            if group.get("data-vcpu") is None:
                continue
            key = (int(group.get("data-core")), int(group.get("data-vcpu")))
            sums = self.bars.setdefault(key, {})
            for bar in group.iter(SVG + "rect"):
                kind = bar.get("class").split()[0]
                sums[kind] = sums.get(kind, 0) + float(bar.get("width")) * scale
            self.missed[key] = sum(path.get("class") == "missed" for path in group.iter(SVG + "path"))
            self.releases[key] = sum(line.get("class") == "release" for line in group.iter(SVG + "line"))

    def words(self):
        return [text.text for text in self.root.iter(SVG + "text")]

    def texts_outside(self):
        """Texts that begin outside of the page."""
        width, height = int(self.root.get("width")), int(self.root.get("height"))
        return [t.text for t in self.root.iter(SVG + "text") if not (0 <= float(t.get("x")) < width and 0 < float(t.get("y")) <= height)]


class Pictures(SketchCase):
    def setUp(self):
        super().setUp()
        self.write("golden/golden.ino", GOLDEN)

    def test_check_draws_the_worst_case(self):
        done = self.run_qduino("check", "golden", "--picture", "a.svg")
        self.assertIn("picture: a.svg", done.stderr)
        page = Page(self.folder / "a.svg")
        self.assertEqual(page.length_ms, 200)
        self.assertEqual(set(page.bars), {(0, 1), (0, 3), (1, 4)})
        for key, ran in {(0, 1): 60, (0, 3): 80, (1, 4): 200}.items():
            self.assertAlmostEqual(page.bars[key]["runs"], ran, delta=0.1)
        self.assertEqual(page.releases[(0, 3)], 20)
        self.assertFalse(any(page.missed.values()))
        self.assertIn("R 54 ms of T 100 ms", page.words())
        self.assertEqual(page.texts_outside(), [])

    def test_check_draws_a_refused_sketch_with_its_miss(self):
        self.write("golden/golden.ino", GOLDEN + "void loop(5, 31, 100, 0) {}\n")
        done = self.run_qduino("check", "golden", "--cores", "1", "--picture", "a.svg", status=2)
        self.assertIn("REFUSED", done.stdout)
        self.assertIn("no picture: no loop stands on a core", done.stderr)
        self.run_qduino("check", "golden", "--picture", "b.svg", status=2)
        page = Page(self.folder / "b.svg")
        self.assertEqual(page.missed[(0, 5)], 2)
        self.assertTrue(any("> T 100 ms" in words for words in page.words()))

    def test_sim_draws_what_each_loop_got(self):
        done = self.run_qduino("sim", "golden", "--for", "1", "--picture", "a.svg")
        self.assertIn("picture: a.svg", done.stderr)
        page = Page(self.folder / "a.svg")
        self.assertAlmostEqual(page.bars[(0, 3)]["runs"], 60, delta=0.1)
        self.assertNotIn("throttled", page.bars[(0, 3)])
        self.assertAlmostEqual(page.bars[(0, 1)]["runs"], 30, delta=0.1)
        self.assertGreater(page.bars[(0, 1)]["throttled"], 50)
        self.assertAlmostEqual(page.bars[(1, 4)]["runs"], 200, delta=0.1)
        self.run_qduino("sim", "golden", "--for", "1", "--picture", "b.svg")
        self.assertEqual((self.folder / "a.svg").read_bytes(), (self.folder / "b.svg").read_bytes(), "the same every time")

        self.run_qduino("sim", "golden", "--for", "1", "--picture", "c.svg", "--from", "0.5", "--length", "0.05")
        page = Page(self.folder / "c.svg")
        self.assertEqual(page.root.get("data-from-ns"), "500000000")
        self.assertAlmostEqual(page.bars[(0, 3)]["runs"], 15, delta=0.05)
        late = self.run_qduino("sim", "golden", "--for", "1", "--picture", "d.svg", "--from", "5", status=1)
        self.assertIn("the run ended before the picture begins", late.stderr)

    def test_missed_deadlines_are_marked_and_counted(self):
        self.write("golden/golden.ino", GOLDEN.replace("4, 10, 0", "4, 11, 0") + LATE)
        done = self.run_qduino("sim", "golden", "--for", "0.2", "--picture", "a.svg", "--length", "0.2")
        overruns = int(re.search(r"(\d+) OVERRUNs", done.stderr)[1])
        self.assertGreater(overruns, 2)
        self.assertEqual(sum(Page(self.folder / "a.svg").missed.values()), overruns)

    def test_trace_draws_beside_the_trace(self):
        done = self.run_qduino("trace", "golden", "--for", "1", "-o", "a.json", "--picture", "a.svg")
        self.assertIn("trace: a.json", done.stderr)
        self.run_qduino("sim", "golden", "--for", "1", "--picture", "b.svg")
        self.assertEqual((self.folder / "a.svg").read_bytes(), (self.folder / "b.svg").read_bytes())

    def test_the_kernel_traces_a_picture_on_linux(self):
        self.trace_on_linux("-o", "a.json", "--picture", "a.svg")
        page = Page(self.folder / "a.svg")
        self.assertEqual(page.length_ms, 400)
        self.assertIn("10 ms in 200 ms", page.words())
        self.assertGreater(page.bars[(0, 2)]["runs"], 0)

    def test_the_manual_shows_what_its_commands_draw(self):
        manual = (TREE / "docs" / "qduino.md").read_text(encoding="utf-8")
        commands = re.findall(r"^`qduino (.*--picture docs/(pictures/.*\.svg).*)`$", manual, re.M)
        self.assertEqual([picture for _, picture in commands], re.findall(r"^!\[.*\]\((pictures/.*)\)$", manual, re.M))
        (sketch,) = re.findall(r"```cpp\n(void setup\(\) \{\}\nvoid loop\(1, 30, 100, 0\).*?)```", manual, re.S)
        self.write("golden/golden.ino", sketch)
        for command, picture in commands:
            words = [str(TREE / word) if word.startswith(("sketches/", "docs/")) else word for word in command.split()]
            words[words.index("--picture") + 1] = "a.svg"
            done = self.run_qduino(*words, status=2 if words[0] == "check" else 0)
            self.assertEqual((self.folder / "a.svg").read_text(), (TREE / "docs" / picture).read_text(),
                             f"make it anew: qduino {command}")
            (shown,) = re.findall(r"```\n(core 0\n.*?)```", manual, re.S)
            if words[0] == "check":
                self.assertIn(shown, done.stdout)

    def test_names_of_files_are_checked_before_anything_runs(self):
        for command in ("check", "sim", "trace"):
            done = self.run_qduino(command, "golden", "--picture", "a.jpg", status=1)
            self.assertIn("ends in .svg", done.stderr)
            self.assertNotIn("Compiling", done.stderr)
        done = self.run_qduino("check", "golden", "--picture", "a.png", status=1, PATH="/nonexistent")
        self.assertIn("take a name that ends in .svg", " ".join(done.stderr.split()))
        self.run_qduino("check", "golden", "--from", "3", status=107)  # of a picture alone
        self.assertFalse(list(self.folder.glob("a.*")))
        done = self.run_qduino("check", "golden", "--picture", "nowhere/a.svg", status=1)
        self.assertIn("nowhere/a.svg", done.stderr)
        done = self.run_qduino("check", "golden", "--picture", "a.svg", "--from", "80000", status=1)
        self.assertIn("a million periods", " ".join(done.stderr.split()))

    def test_a_png_is_made_by_the_converter_of_this_computer(self):
        tools = self.folder / "tools"
        tools.mkdir()
        converter = tools / "rsvg-convert"
        converter.write_text('#!/bin/sh\ncat > "$4"\n', encoding="utf-8")
        converter.chmod(converter.stat().st_mode | stat.S_IXUSR)
        self.run_qduino("check", "golden", "--picture", "a.png", PATH=f"{tools}:{os.environ['PATH']}")
        self.assertEqual(Page(self.folder / "a.png").length_ms, 200)

    def test_the_terminal_shows_a_short_form(self):
        for locale in ("C.UTF-8", "C"):
            checked = self.run_qduino("check", "golden", LC_ALL=locale).stdout
            run = self.run_qduino("sim", "golden", "--for", "1", LC_ALL=locale).stderr
            for text in (checked, run):
                self.assertRegex(text, r"core 0\n  loop 3  .*\n  loop 1  .*\ncore 1\n  loop 4  ")
                self.assertLessEqual(max(map(len, text.splitlines())), 80)
                self.assertEqual(text.isascii(), locale == "C")
                self.assertRegex(text, r"loop 1  .{36}[|│] R 54 ms of T 100 ms")
        many = "void setup() {}\n" + "".join(f"void loop({i}, 1, {100 + i}, 0) {{ waitForNextPeriod(); }}\n" for i in range(1, 14))
        self.write("many/many.ino", many)
        self.assertNotIn("core 0\n  loop", self.run_qduino("check", "many").stdout)


if __name__ == "__main__":
    unittest.main(verbosity=2)
