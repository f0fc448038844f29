"""qduino size: what a sketch takes of memory. Numbers are compared with one another, never with a compiler's."""
import json
import tempfile
import unittest

from sketch_case import SketchCase

ARRAY_BYTES = 200_000


class Size(SketchCase):
    @classmethod
    def setUpClass(cls):
        """One cache for all: Arduino.h is read once for each board."""
        cls.cache = cls.enterClassContext(tempfile.TemporaryDirectory())

    def setUp(self):
        super().setUp()
        self.environment["XDG_CACHE_HOME"] = self.cache

    def sketch(self, name, variables="", body=""):
        return self.write(f"{name}/{name}.ino", f"{variables}\nvoid setup() {{ {body} }}\nvoid loop() {{ delay(100); }}\n").parent

    def bytes_of(self, folder, *options):
        return json.loads(self.run_qduino("size", folder, "--json", *options).stdout)

    def test_each_variable_is_where_it_belongs(self):
        """The same sketch with an array of each kind: only its own column grows, in the program and in the sketch's own files."""
        write, read = "for (char& c : array) c = millis();", "Serial.println(array[millis()]);"
        plain = self.bytes_of(self.sketch("plain"))
        self.assertGreater(plain["linux"]["program"]["code"], plain["linux"]["own_files"]["code"])
        for kind, array, use in (("zeroed", f"char array[{ARRAY_BYTES}];", write), ("data", f"char array[{ARRAY_BYTES}] = {{1}};", write),
                                 ("code", f"extern const char array[{ARRAY_BYTES}];\nconst char array[{ARRAY_BYTES}] = {{1}};", read)):
            with self.subTest(kind):
                sizes = self.bytes_of(self.sketch(kind + "s", array, use))
                boards = [board for board in ("linux", "metal") if sizes[board]]
                self.assertIn("linux", boards)
                for board in boards:
                    # An image is filled up to whole pages of 2 MiB, which may have had the room.
                    for of in ("program", "own_files") if board == "linux" else ("own_files",):
                        grown = {part: sizes[board][of][part] - plain[board][of][part] for part in ("code", "data", "zeroed")}
                        self.assertGreaterEqual(grown[kind], ARRAY_BYTES, (board, of))
                        self.assertLess(sum(grown.values()), 2 * ARRAY_BYTES, (board, of, "nothing else grows by as much"))

    def test_a_person_gets_a_table_and_a_sentence(self):
        done = self.run_qduino("size", self.sketch("blinker"))
        self.assertRegex(done.stdout.splitlines()[0], r"code +data +zeroed +together$")
        self.assertRegex(done.stdout, r"(?m)^Linux +\d+ KiB")
        self.assertRegex(done.stdout, r"(?m)^  its own files +\d+ B")
        self.assertRegex(done.stderr, r"blinker takes \d+ KiB on Linux, \d+ B of it for its own files\.")
        self.assertLessEqual(max(map(len, done.stdout.splitlines())), 80)

    def test_the_stack_is_the_board_files(self):
        board = self.write("board.toml", "[linux]\nstack_bytes = 262144\n")
        folder = self.sketch("small")
        self.assertEqual(self.bytes_of(folder, "--board", board)["linux_stack"], 262144)
        self.assertIn("256 KiB", self.run_qduino("size", folder, "--board", board).stdout)

    def test_what_does_not_compile_has_no_size(self):
        done = self.run_qduino("size", self.sketch("broken", "int;;)"), status=1)
        self.assertIn("broken.ino", done.stderr)
        self.assertEqual(done.stdout, "")


if __name__ == "__main__":
    unittest.main()
