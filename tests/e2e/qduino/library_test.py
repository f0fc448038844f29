"""Libraries as a person has them: found by the headers that a sketch includes, installed, listed, removed; bad ones change nothing."""

import hashlib
import json
import os
import pathlib
import shutil
import stat
import subprocess
import unittest
import zipfile

from sketch_case import PROGRAM, SketchCase

SKETCH = """
    #include <{0}.h>
    void setup() {{ Serial.begin(9600); Serial.println({0}_answer()); }}
    void loop() {{ delay(1000); }}
"""


class Libraries(SketchCase):
    def setUp(self):
        super().setUp()
        self.environment["HOME"] = str(self.folder / "home")
        for name in ("QDUINO_LIBRARIES", "QDUINO_LIBRARY_INDEX"):
            self.environment.pop(name, None)
        self.user = self.folder / "home/Arduino/libraries"

    def sketch(self, header, name="s"):
        return self.write(f"{name}/{pathlib.Path(name).name}.ino", SKETCH.format(header)).parent

    def said_by(self, sketch):
        return self.run_qduino("sim", sketch, "--for", "1").stdout.split("\n")[0]

    def library(self, place, name, answer, properties=""):
        """A library with one function, which gives its answer."""
        where = f"{place}/{name}" + ("/src" if properties else "")
        if properties:
            self.write(f"{place}/{name}/library.properties", properties)
        self.write(f"{where}/{name}.h", f'#pragma once\nint {name}_answer();\n')
        self.write(f"{where}/{name}.cpp", f'#include "{name}.h"\nint {name}_answer() {{ return {answer}; }}\n')
        return self.folder / place / name

    # ---- found -----------------------------------------------------------------------------------

    def test_a_library_and_what_it_needs_in_turn(self):
        """Outer (1.5, sources at any depth) needs Middle (1.0 with utility/, C and assembler), in a .cpp alone; that needs Inner."""
        self.write("libraries/Outer/library.properties", "name=Outer Library\nversion=1.0.0\narchitectures=avr\n")
        self.write("libraries/Outer/src/Outer.h", "#pragma once\nint Outer_answer();\n")
        self.write("libraries/Outer/src/deep/er/o.cpp",
                   "#include <Outer.h>\n#include <Middle.h>\nint Outer_answer() { return 1000 + middle() + from_assembler(); }\n")
        self.write("libraries/Middle/Middle.h", "#pragma once\n#if ARDUINO >= 100\n#include <Arduino.h>\n#else\n#include <WProgram.h>\n#endif\n"
                   "#ifdef __cplusplus\nextern \"C\"\n#endif\nint middle(void);\n"
                   "#ifdef __cplusplus\nextern \"C\"\n#endif\nint from_assembler(void);\n")
        self.write("libraries/Middle/utility/help.h", "int help(void);\n")
        self.write("libraries/Middle/utility/help.c", "#include <Middle.h>\n#include <Inner.h>\nint help(void) { return INNER; }\n")
        self.write("libraries/Middle/middle.c", "#include \"Middle.h\"\n#include <help.h>\nint middle(void) { return help(); }\n")
        self.write("libraries/Middle/a.S", ".globl from_assembler\nfrom_assembler:\n"
                   "#if defined(__aarch64__)\nmov w0, #7\n#else\nmov $7, %eax\n#endif\nret\n.section .note.GNU-stack,\"\",%progbits\n")
        self.write("libraries/Inner/Inner.h", "#define INNER 300\n")
        self.write("libraries/Unused/Unused.h", "")
        self.write("libraries/Unused/broken.cpp", "this does not compile\n")
        sketch = self.sketch("Outer", "book/s")
        built = self.run_qduino("build", sketch, "--only", "sim")
        self.assertIn("Compiling Outer Library: deep/er/o.cpp", built.stderr)
        self.assertIn("Outer Library says that it is for avr alone", built.stderr)
        self.assertEqual(self.said_by(sketch), "1307")
        self.assertEqual(self.run_qduino("check", sketch).returncode, 0)
        again = self.run_qduino("build", sketch, "--only", "sim")
        self.assertEqual(again.stderr, "Verdict: s is up to date.\n")

        # A changed header of a library is seen; a library that is not included any more is gone.
        self.write("libraries/Inner/Inner.h", "#define INNER 400\n")
        self.assertEqual(self.said_by(sketch), "1407")
        self.write("libraries/Middle/utility/help.c", "#include <Middle.h>\nint help(void) { return 1; }\n")
        shutil.rmtree(self.folder / "libraries/Inner")
        self.assertEqual(self.said_by(sketch), "1008")

    def test_the_sketchs_own_library_takes_the_place_of_the_users(self):
        self.library("home/Arduino/libraries", "Same", 1)
        sketch = self.sketch("Same")
        self.assertEqual(self.said_by(sketch), "1")
        self.library("s/libraries", "Same", 2)
        self.assertEqual(self.said_by(sketch), "2")
        shutil.rmtree(self.folder / "s/libraries")
        self.assertEqual(self.said_by(sketch), "1")

    def test_a_second_sketch_takes_the_objects_that_the_first_has_made(self):
        self.library("home/Arduino/libraries", "Both", 1)
        self.assertIn("Compiling Both: Both.cpp", self.run_qduino("build", self.sketch("Both", "one"), "--only", "sim").stderr)
        second = self.run_qduino("build", self.sketch("Both", "two"), "--only", "sim").stderr
        self.assertIn("Compiling two.ino", second)
        self.assertNotIn("Compiling Both", second)
        self.assertEqual(self.said_by("two"), "1")
        # What one sketch says of a library is no other sketch's business.
        self.write("one/Both.h", "#error of the sketch\n")
        self.write("home/Arduino/libraries/Both/Both.cpp", "#include <Both.h>\nint Both_answer() { return 2; }\n")
        self.assertEqual(self.said_by("two"), "2")
        (self.folder / "one/Both.h").unlink()
        self.assertNotIn("Compiling Both", self.run_qduino("build", "one", "--only", "sim").stderr)
        self.assertEqual(self.said_by("one"), "2")
        other_flags = self.run_qduino("build", "two", "--only", "sim", CXXFLAGS="-DOTHER")
        self.assertIn("Compiling Both: Both.cpp", other_flags.stderr)

    def test_a_file_of_a_library_that_is_for_another_chip_is_left_out(self):
        """One driver of many writes a timer's registers. Who uses another one does not need it; who does hears of its errors."""
        self.library("home/Arduino/libraries", "Many", 5)
        self.write("home/Arduino/libraries/Many/OfTimer.h", "#pragma once\nint OfTimer_answer();\n")
        self.write("home/Arduino/libraries/Many/OfTimer.cpp", "int OfTimer_answer() { return TCCR1A; }\n")
        built = self.run_qduino("build", self.sketch("Many"), "--only", "sim")
        self.assertIn("Compiling Many: OfTimer.cpp failed: it is left out. The sketch does not need it.", built.stderr)
        self.assertNotIn("error", built.stderr)
        self.assertEqual(self.said_by("s"), "5")
        refused = self.run_qduino("build", self.sketch("OfTimer", "t"), "--only", "sim", status=1)
        self.assertIn("‘TCCR1A’ was not declared", refused.stderr)
        self.assertIn("Compiling Many: OfTimer.cpp failed: it is left out, and the sketch needs it.", refused.stderr)

    def test_what_nobody_calls_may_want_what_nobody_has(self):
        """As with the Arduino builder, whose linker leaves out what is not reached before it looks for names."""
        self.write("s/s.ino", "extern char nowhere[];\nint unused() { return nowhere[0]; }\n"
                              "void setup() { Serial.begin(9600); Serial.println(7); }\nvoid loop() { delay(1000); }\n")
        self.assertEqual(self.said_by("s"), "7")
        self.run_qduino("build", "s", "--only", "linux")

    def test_a_changed_tool_compiles_anew(self):
        """Each file of the tool that stands before the compilers: objects that an older one made are not taken."""
        sdk_file = pathlib.Path(PROGRAM).resolve().parents[1] / "qduino-sdk.json"
        sdk = json.loads(sdk_file.read_text(encoding="utf-8"))
        tools = self.folder / "tools"
        shutil.copytree(pathlib.Path(sdk["as_arduino"]).parent, tools)
        for tool in ("as_arduino", "ino_to_cpp"):
            sdk[tool] = str(tools / f"{tool}.py")
        self.environment["QDUINO_HOME"] = str(self.write("qduino-sdk.json", json.dumps(sdk)))
        self.library("home/Arduino/libraries", "Plain", 1)
        sketch = self.sketch("Plain")
        self.run_qduino("build", sketch, "--only", "sim")
        for tool in ("as_arduino", "ino_to_cpp", "own_names"):
            self.assertEqual(self.run_qduino("build", sketch, "--only", "sim").stderr, "Verdict: s is up to date.\n")
            os.utime(tools / f"{tool}.py")
            built = self.run_qduino("build", sketch, "--only", "sim").stderr
            self.assertIn("Compiling s.ino", built, tool)
            self.assertIn("Compiling Plain: Plain.cpp", built, tool)

    def test_a_condition_decides_which_library_is_needed(self):
        self.library("libraries", "First", 1)
        self.library("libraries", "Second", 2)
        text = ("#define USE_SECOND\n#ifdef USE_SECOND\n#include <Second.h>\n#define answer Second_answer\n"
                "#else\n#include <First.h>\n#define answer First_answer\n#endif\n"
                "void setup() { Serial.begin(9600); Serial.println(answer()); }\nvoid loop() { delay(1000); }\n")
        sketch = self.write("s/s.ino", text).parent
        self.environment["QDUINO_LIBRARIES"] = str(self.folder / "libraries")
        built = self.run_qduino("build", sketch, "--only", "sim")
        self.assertIn("Second.cpp", built.stderr)
        self.assertNotIn("First.cpp", built.stderr)
        self.write("s/s.ino", text.replace("#define USE_SECOND", ""))
        built = self.run_qduino("build", sketch, "--only", "sim")
        self.assertIn("First.cpp", built.stderr)
        self.assertEqual(self.said_by(sketch), "1")

    def test_the_boards_own_headers_come_first(self):
        self.library("libraries", "Servo", 1)
        self.environment["QDUINO_LIBRARIES"] = str(self.folder / "libraries")
        self.write("s/s.ino", "#include <Servo.h>\nServo servo;\nvoid setup() { servo.attach(9); }\nvoid loop() { delay(1000); }\n")
        self.assertNotIn("Servo.cpp", self.run_qduino("build", "s", "--only", "sim").stderr)

    def test_a_header_that_nobody_has_is_named(self):
        self.library("libraries", "First", 1)
        self.environment["QDUINO_LIBRARIES"] = str(self.folder / "libraries")
        refused = self.run_qduino("build", self.sketch("Missing"), "--only", "sim", status=1)
        self.assertIn("s.ino:2:", refused.stderr)
        self.assertIn("no library here has Missing.h", refused.stderr)

    def test_a_library_without_sources_is_refused(self):
        self.library("libraries", "Blob", 1, "name=Blob\nprecompiled=full\n")
        self.environment["QDUINO_LIBRARIES"] = str(self.folder / "libraries")
        self.assertIn("comes without its sources", self.run_qduino("build", self.sketch("Blob"), status=1).stderr)

    def test_a_librarys_flags_run_nothing(self):
        """A linker that is given -B takes its programs from there, the library's own folder."""
        self.library("libraries", "Evil", 1, "name=Evil\x1b[31m\nldflags=-B%s\n" % self.folder)
        self.write("ld", "#!/bin/sh\ntouch '%s/ran'\nexec /usr/bin/ld \"$@\"\n" % self.folder)
        (self.folder / "ld").chmod(0o755)
        self.environment["QDUINO_LIBRARIES"] = str(self.folder / "libraries")
        refused = self.run_qduino("build", self.sketch("Evil"), "--only", "sim", status=1)
        self.assertFalse((self.folder / "ran").exists())
        self.assertIn("asks for the linker's flag '-B", " ".join(refused.stderr.split()))
        self.assertNotIn("\x1b[31m", refused.stderr)

    def test_a_transport_that_runs_a_command_is_refused(self):
        for url, name in (("ext::sh -c 'touch %s/ran' x.git" % self.folder, "ext"), ("fd::0/x.git", "fd")):
            refused = self.run_qduino("lib", "install", url, status=1)
            self.assertFalse((self.folder / "ran").exists(), url)
            self.assertIn("transport '%s' not allowed" % name, " ".join(refused.stderr.split()))

    # ---- installed -------------------------------------------------------------------------------

    def installed(self):
        return sorted(p.name for p in self.user.iterdir()) if self.user.is_dir() else []

    def refused(self, *words, because):
        before = self.installed()
        done = self.run_qduino("lib", *words, status=1)
        self.assertIn(because, " ".join(done.stderr.split()))
        self.assertEqual(self.installed(), before)

    def zip(self, name, files, links=()):
        path = self.folder / name
        with zipfile.ZipFile(path, "w") as archive:
            for file, text in files.items():
                archive.writestr(file, text)
            for link, target in links:
                entry = zipfile.ZipInfo(link)
                entry.external_attr = (stat.S_IFLNK | 0o777) << 16
                archive.writestr(entry, target)
        return path

    def library_zip(self, name, answer, around="", properties=None):
        text = f"name={name}\nversion=1.0\n" if properties is None else properties
        return self.zip(f"{name}.zip", {f"{around}library.properties": text, f"{around}src/{name}.h": f"int {name}_answer();\n",
                                        f"{around}src/{name}.cpp": f"int {name}_answer() {{ return {answer}; }}\n"})

    def test_a_folder_is_installed_listed_used_and_removed(self):
        made = self.library("elsewhere", "Foo", 5, "name=The Foo\nversion=1.2.3\nincludes=Foo.h\n")
        done = self.run_qduino("lib", "install", made)
        self.assertEqual(done.stdout, f"{self.user}/The_Foo\n")
        self.assertIn("include <Foo.h>", done.stderr)
        self.assertRegex(self.run_qduino("lib", "list").stdout, r"^The Foo +1\.2\.3 +/.*/The_Foo <Foo\.h>\n$")
        self.assertEqual(self.said_by(self.sketch("Foo")), "5")
        self.refused("install", made, because="is there already")
        self.refused("remove", "Foo", because="no library 'Foo'")
        self.run_qduino("lib", "remove", "The Foo")
        self.assertEqual(self.installed(), [])
        self.assertEqual(self.run_qduino("lib", "list").stdout, "")

    def test_a_zip_of_a_repository(self):
        self.run_qduino("lib", "install", self.library_zip("Foo", 6, around="Foo-master/", properties=""))
        self.assertEqual(self.installed(), ["Foo"])
        self.assertEqual(self.said_by(self.sketch("Foo")), "6")

    def test_a_git_repository_and_a_tag_of_it(self):
        repository = self.library("work", "Foo", 7, "name=Foo\nversion=1\n")
        git = ["git", "-C", str(repository), "-c", "user.name=x", "-c", "user.email=x@y"]
        for command in (["init", "-q"], ["add", "."], ["commit", "-qm", "one"], ["tag", "v1"]):
            subprocess.run([*git, *command], check=True)
        self.library("work", "Foo", 8, "name=Foo\nversion=2\n")
        subprocess.run([*git, "commit", "-qam", "two"], check=True)
        url = f"file://{repository}"
        self.run_qduino("lib", "install", url + "#v1")
        self.assertEqual(self.said_by(self.sketch("Foo")), "7")
        self.run_qduino("lib", "remove", "Foo")
        self.run_qduino("lib", "install", url)
        self.assertEqual(self.said_by(self.sketch("Foo")), "8")
        self.assertFalse((self.user / "Foo/.git").exists())
        self.run_qduino("lib", "remove", "Foo")
        self.refused("install", url + "#nothing", because="git")
        self.refused("install", "file:///nowhere/at/all.git", because="git")

    def index(self, *entries):
        libraries = []
        for path, more in entries:
            content = path.read_bytes()
            libraries.append({"name": path.stem, "version": "1.0", "url": f"file://{path}", "size": len(content), "sentence": "Answers.",
                              "checksum": "SHA-256:" + hashlib.sha256(content).hexdigest(), **more})
        self.environment["QDUINO_LIBRARY_INDEX"] = str(self.write("index.json", json.dumps({"libraries": libraries})))

    def test_the_index_is_searched_and_its_libraries_are_verified(self):
        foo, bar = self.library_zip("Foo", 9), self.library_zip("Bar", 10)
        self.index((foo, {"dependencies": [{"name": "Bar"}]}), (bar, {}))
        found = self.run_qduino("lib", "search", "answers", "foo")
        self.assertEqual(found.stdout, "Foo@1.0\n    Answers.\n")
        self.refused("install", "Fooo", because="Did you mean Foo?")
        self.refused("install", "Foo@2", because="no such library")
        self.run_qduino("lib", "install", "Foo")
        self.assertEqual(self.installed(), ["Bar", "Foo"])
        self.assertEqual(self.said_by(self.sketch("Foo")), "9")

        self.run_qduino("lib", "remove", "Foo", "Bar")
        self.index((foo, {"checksum": "SHA-256:" + "0" * 64}))
        self.refused("install", "Foo", because="not what the index promises")
        self.index((foo, {"size": foo.stat().st_size - 1}))
        self.refused("install", "Foo", because="")
        self.index((foo, {"dependencies": [{"name": "Nobody"}]}))
        self.refused("install", "Foo", because="Nobody")
        self.write("index.json", "{ not an index")
        self.refused("install", "Foo", because="the index of libraries is not what it should be")
        self.environment["QDUINO_LIBRARY_INDEX"] = str(self.folder / "nowhere.json")
        self.refused("search", "Foo", because="curl")

    def test_what_is_no_library_changes_nothing(self):
        self.library("home/Arduino/libraries", "Kept", 1)
        (self.folder / "empty").mkdir()
        self.write("text.zip", "this is no archive")
        self.refused("install", "empty", because="that is no library")
        self.refused("install", "text.zip", because="no zip")
        self.refused("install", self.zip("up.zip", {"Foo/Foo.h": "", "../../../outside.h": "x"}), because="leads out of it")
        self.refused("install", self.zip("root.zip", {"Foo/Foo.h": "", "/tmp/outside.h": "x"}), because="leads out of it")
        self.refused("install", self.zip("link.zip", {"Foo.h": ""}, [("passwd", "/etc/passwd")]), because="a link")
        linked = self.library("elsewhere", "Linked", 1)
        (linked / "passwd").symlink_to("/etc/passwd")
        self.refused("install", linked, because="no links")
        self.refused("install", self.user.parent, because="holds the libraries themselves")
        self.refused("install", because="needs to know which")
        self.assertFalse((self.folder / "outside.h").exists())
        damaged = self.library_zip("Foo", 1)
        content = bytearray(damaged.read_bytes())
        content[content.index(b"int Foo") + 4] ^= 1
        damaged.write_bytes(content)
        self.refused("install", damaged, because="damaged")
        names = self.library("elsewhere", "Evil", 1, "name=../../evil\n")
        self.run_qduino("lib", "install", names)
        self.assertEqual(self.installed(), ["Kept", "_.._.._evil"])


if __name__ == "__main__":
    unittest.main()
