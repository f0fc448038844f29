"""What a random sketch tries: each probe prints lines whose words must be the same on a Mega and here.

A probe's text stands at three places: before setup(), in a function of its own, and behind loop() (there its functions stand, and the
Arduino way of building writes their prototypes). All names of a probe end with its number, so a sketch may hold any set of them.
"""

import random

import values
from values import BOARDS, Expression, Undefined

WORDS = sorted(BOARDS[0].types)
INTEGERS = [word for word in WORDS if word not in ("float", "double", "bool")]
# Names of the C library and of POSIX that a sketch may use for its own things.
TAKEN = ["time", "clock", "pipe", "read", "write", "select", "index", "y1", "j0", "link", "pause", "sync", "access", "signal", "wait", "kill", "times",
         "remove", "rename", "stat", "open", "close", "sleep", "alarm", "dup", "environ", "daylight", "timezone", "gamma", "send", "recv", "accept",
         "bind", "listen", "socket", "connect", "poll", "truncate", "system", "raise", "tmpfile", "getline", "basename", "div", "acct", "brk", "nice",
         "drem", "significand", "logb", "scalb", "hypot", "idle", "progress", "Channel", "Mutex", "Spool", "Lock", "Board", "Vcpu", "Pin", "Level"]


class Probe:
    def __init__(self, kind, body, before="", after=""):
        self.kind, self.body, self.before, self.after = kind, body, before, after


class Maker:
    """Makes the probe of one number."""

    def __init__(self, chance: random.Random, number):
        self.chance, self.number = chance, number
        self.declared = []

    def name(self, stem):
        return "%s_%d" % (stem, self.number)

    # ---- expressions ------------------------------------------------------------------------
    def number_for(self, kind):
        bits = kind.bits
        limit = 1 << (bits - 1 if kind.signed else bits)
        pick = self.chance.choice([0, 1, 2, 5, 7, 10, 63, 100, 127, 128, 200, 255, 256, 1000, 1023, 4095, 32767, 32768, 40000, 65535, 65536, 100000,
                                   86400000, 2147483647, 2147483648, 4294967295, limit - 1, limit // 2, self.chance.randrange(limit)])
        value = pick % limit
        return -value if kind.signed and self.chance.random() < 0.4 else value

    def variable(self, words=WORDS):
        """A variable with a value, declared in the probe's function."""
        word = self.chance.choice(words)
        on = [board.types[word] for board in BOARDS]
        if on[0].is_float:
            value = self.dyadic()
        else:
            value = self.number_for(min(on, key=lambda kind: kind.bits))
            if word == "bool":
                value &= 1
        name = "v%d" % len(self.declared)
        text = self.written(value, on[0])
        self.declared.append("%s%s %s = %s;" % (self.chance.choice(["", "volatile ", "const ", "static "]), word, name, text))
        return Expression(name, [(kind, value) for kind in on])

    def dyadic(self):
        return values.as_float(values.fractions.Fraction(self.chance.randrange(-4096, 4096), self.chance.choice([1, 2, 4, 8])))

    def written(self, value, kind):
        """As an initializer."""
        if kind.is_float:
            return "%.3f" % float(value)
        suffix = {64: "LL", 32: "L"}.get(kind.bits, "")
        if not kind.signed:
            suffix = "U" + suffix
        if kind.signed and value == -(1 << (kind.bits - 1)):
            return "(%d%s - 1)" % (value + 1, suffix)
        return "%d%s" % (value, suffix)

    def literal(self):
        form = self.chance.randrange(6)
        if form == 0:
            value = self.dyadic()
            return Expression("%.3f%s" % (float(value), self.chance.choice(["", "f"])) if value >= 0 else "(%.3f)" % float(value),
                              [(values.FLOAT, value)] * 2)
        if form == 1:
            letter = self.chance.choice("azAZ09 _")
            return Expression("'%s'" % letter, [(board.types["char"], ord(letter)) for board in BOARDS])
        is_hex = form == 2
        suffix = self.chance.choice(["", "", "U", "L", "UL"])
        value = abs(self.number_for(BOARDS[0].types["unsigned long"]))
        text = ("0x%X" % value if is_hex else "%d" % value) + suffix
        return Expression.of(text, lambda board, _: (board.literal(value, suffix, is_hex), value))

    def expression(self, depth):
        for _ in range(60):
            try:
                return self.try_expression(depth)
            except Undefined:
                continue
        return self.variable()

    def try_expression(self, depth):
        if depth == 0:
            return self.variable() if self.chance.random() < 0.7 else self.literal()
        form = self.chance.random()
        left = self.expression(depth - 1)
        if form < 0.12:
            return left.cast(self.chance.choice(WORDS))
        if form < 0.2:
            return left.unary(self.chance.choice("-~!"))
        right = self.expression(depth - 1)
        if form < 0.28:
            return self.expression(depth - 1).choice(left, right)
        if form < 0.36:
            return self.of_the_language(left, right)
        sign = self.chance.choice(["+", "-", "*", "/", "%", "&", "|", "^", "<<", ">>", "<", ">", "==", "!=", "&&", "||"])
        return left.binary(sign, right)

    def of_the_language(self, left, right):
        """Arduino's macros, by what its reference says they are. Their arguments have no side effects here."""
        form = self.chance.choice(["constrain", "min", "max", "abs", "sq", "bitRead", "lowByte", "highByte"])
        if form == "constrain":
            limits = sorted([right, self.expression(0)], key=lambda each: each.value)
            inner = left.binary(">", limits[1]).choice(limits[1], left)
            result = left.binary("<", limits[0]).choice(limits[0], inner)
            return Expression("constrain(%s, %s, %s)" % (left.text, limits[0].text, limits[1].text), result.on)
        if form in ("min", "max"):
            result = left.binary("<" if form == "min" else ">", right).choice(left, right)
            return Expression("%s(%s, %s)" % (form, left.text, right.text), result.on)
        if form == "abs":
            result = left.binary(">", Expression("0", [(board.int, 0) for board in BOARDS])).choice(left, left.unary("-"))
            return Expression("abs(%s)" % left.text, result.on)
        if form == "sq":
            return Expression("sq(%s)" % left.text, left.binary("*", left).on)
        if left.is_float:
            raise Undefined
        if form == "bitRead":
            bit = self.chance.randrange(min(kind.bits for kind, _ in left.on))
            shifted = left.binary(">>", Expression("%d" % bit, [(board.int, bit) for board in BOARDS]))
            one = Expression("1", [(board.int, 1) for board in BOARDS])
            return Expression("bitRead(%s, %d)" % (left.text, bit), shifted.binary("&", one).on)
        byte = left.value & 255 if form == "lowByte" else left.value >> 8 & 255
        return Expression("%s(%s)" % (form, left.text), [(board.types["byte"], byte) for board in BOARDS])

    def of_type(self, word, depth=2):
        """An expression that has this type, and fits."""
        for _ in range(60):
            try:
                return self.expression(depth).cast(word)
            except Undefined:
                continue
        return Expression("((%s)7)" % word, [(board.types[word], 7) for board in BOARDS])

    # ---- probes -----------------------------------------------------------------------------
    def body(self, *lines):
        return "\n".join(["  " + line for line in self.declared + list(lines)])

    def printed(self):
        """An expression's own type chooses print()."""
        each = self.expression(self.chance.choice([1, 2, 2, 3]))
        if each.is_float:
            return Probe("a printed float", self.body("Serial.println(%s, 3);" % each.text))
        if all(kind.bits == 8 and kind.signed for kind, _ in each.on):
            return Probe("a printed char", self.body("Serial.println((int)(%s));" % each.text))
        if each.value >= 0 and self.chance.random() < 0.4:
            base = self.chance.choice(["HEX", "BIN", "OCT", "DEC", "36", "7"])
            return Probe("a printed number in a base", self.body("Serial.println(%s, %s);" % (each.text, base)))
        if any(kind.bits > 32 for kind, _ in each.on):  # the AVR's Print has none for these
            return Probe("a printed number of 64 bits", self.body("Serial.print((long)((%s) >> 31 >> 1)); Serial.print(' ');" % each.text,
                                                                  "Serial.println((unsigned long)(%s));" % each.text))
        return Probe("a printed number", self.body("Serial.println(%s);" % each.text))

    def stored(self):
        """By an assignment, a compound one, an array, a union, a pointer or a field."""
        word = self.chance.choice(["long", "unsigned long", "int32_t", "uint32_t", "int16_t", "uint16_t", "int8_t", "byte"])
        each = self.of_type(word)
        form = self.chance.randrange(5)
        kind = BOARDS[0].types[word]
        show = "Serial.println(%s);" if kind.bits > 8 else "Serial.println((int)%s);"
        if form == 0:
            return Probe("an array", self.body("%s a[3] = {1, %s, 3};" % (word, each.text), show % "a[1]",
                                               "Serial.println((int)(sizeof a / sizeof a[0]));", "Serial.println((int)sizeof a);"))
        if form == 1:
            return Probe("a union", self.body("union { %s whole; byte part[%d]; } u;" % (word, kind.bits // 8), "u.whole = %s;" % each.text,
                                              *["Serial.println(u.part[%d], HEX);" % i for i in range(kind.bits // 8)]))
        if form == 2:
            return Probe("a pointer", self.body("%s a[2] = {%s, 9};" % (word, each.text), "%s* p = a;" % word,
                                                "Serial.println((int)((char*)(p + 1) - (char*)p));", show % "*p++", show % "*p"))
        if form == 3:
            return Probe("a field", self.body("struct %s s = {%s};" % (self.name("Field"), each.text), show % "s.value",
                                              "Serial.println((int)sizeof s.value);"), "struct %s { %s value; };\n" % (self.name("Field"), word))
        bits = self.chance.randrange(1, 9)
        return Probe("a bit field", self.body("struct { %s a : %d; } s;" % ("uint8_t" if bits < 9 else "uint16_t", bits),
                                              "s.a = %d;" % self.chance.randrange(1 << bits), "Serial.println((int)s.a);"))

    def of_arduino(self):
        """A macro of the language by itself, of arguments of several types."""
        for _ in range(60):
            try:
                each = self.of_the_language(self.expression(1), self.expression(1))
                if each.is_float:
                    return Probe("a float of a macro", self.body("Serial.println(%s, 3);" % each.text))
                if all(kind.bits <= 32 for kind, _ in each.on):
                    return Probe("a macro of the language", self.body("Serial.println((long)%s);" % each.text))
            except Undefined:
                continue
        return self.printed()

    # ---- formats ----------------------------------------------------------------------------
    def conversion(self):
        """A conversion and its argument."""
        flags = "".join(sorted(set(self.chance.choice(["", "-", "0", "+", " ", "#"]) for _ in range(2))))
        width = self.chance.choice(["", "", "5", "12", "3"])
        form = self.chance.choice("ld lu lx lX li lo d u x c s %".split())
        if form == "%":
            return "%%", None
        if form == "s":
            return "%" + flags.replace("0", "").replace("+", "").replace("#", "").replace(" ", "") + width + "s", '"word"'
        if form == "c":
            return "%c", "'%s'" % self.chance.choice("aZ5")
        word = {"ld": "long", "li": "long", "d": "int", "lu": "unsigned long", "lx": "unsigned long", "lX": "unsigned long", "lo": "unsigned long",
                "u": "unsigned int", "x": "unsigned int"}[form]
        if word in ("unsigned int", "unsigned long"):
            flags = flags.replace("+", "").replace(" ", "")
        if form[-1] in "du i":
            flags = flags.replace("#", "")
        if "-" in flags:
            flags = flags.replace("0", "")
        if "+" in flags:
            flags = flags.replace(" ", "")
        each = self.of_type(word, 1)
        if "#" in flags and each.value == 0:
            flags = flags.replace("#", "")
        return "%" + flags + width + form, each.text

    def format(self):
        parts, arguments = [], []
        for _ in range(self.chance.randrange(1, 4)):
            text, argument = self.conversion()
            parts.append(text)
            if argument is not None:
                arguments.append(argument)
        return self.chance.choice(["|", " ", ","]).join(parts) + "|", arguments

    def formatted(self):
        text, arguments = self.format()
        rest = "".join(", " + each for each in arguments)
        say, wrap = self.name("say"), self.name("wrap")
        out = ["char b[120];"]
        form = self.chance.randrange(11)
        before = after = ""
        own = "void %s(const char* format, ...) {\n  char b[120];\n  va_list list;\n  va_start(list, format);\n  %s\n  va_end(list);\n  Serial.println(b);\n}\n"
        if form == 0:
            kind, call = "a literal format", 'sprintf(b, "%s"%s);' % (text, rest)
        elif form == 1:
            kind, call = "snprintf", 'snprintf(b, sizeof b, "%s"%s);' % (text, rest)
        elif form == 2:
            kind, call = "sprintf_P with PSTR", 'sprintf_P(b, PSTR("%s")%s);' % (text, rest)
        elif form == 3:
            kind, call = "a format in a variable", 'const char* f = "%s"; sprintf(b, f%s);' % (text, rest)
        elif form == 4:
            kind, before = "a format in flash", 'const char %s[] PROGMEM = "%s";\n' % (self.name("kept"), text)
            call = "sprintf_P(b, %s%s);" % (self.name("kept"), rest)
        elif form == 5:
            kind, call = "a format by a condition", 'sprintf(b, b != 0 ? "%s" : "%%s"%s);' % (text, rest)
        elif form == 6:
            kind, after = "a printf of the sketch", own % (say, self.chance.choice(["vsnprintf(b, sizeof b, format, list);", "vsprintf(b, format, list);"]))
            return Probe(kind, self.body('%s("%s"%s);' % (say, text, rest)), "#include <stdarg.h>\n", after)
        elif form == 7:
            kind, before = "a printf of the sketch, by a macro", "#include <stdarg.h>\n#define %s(f, ...) %s(f, ##__VA_ARGS__)\n" % (wrap, say)
            return Probe(kind, self.body('%s("%s"%s);' % (wrap, text, rest)), before, own % (say, "vsnprintf(b, sizeof b, format, list);"))
        elif form == 8:
            kind, before = "a format in a table", 'const char* const %s[] = {"%%d", "%s"};\n' % (self.name("table"), text)
            call = "sprintf(b, %s[1]%s);" % (self.name("table"), rest)
        elif form == 9:
            kind, before = "a format through a template", ("template <class... A> void %s(char* b, const char* f, A... a) { sprintf(b, f, a...); }\n" % wrap)
            call = '%s(b, "%s"%s);' % (wrap, text, rest)
        else:
            first, between, second = text.partition("|")
            kind = "a format that was put together"
            call = 'char f[60]; strcpy(f, "%s"); strcat(f, "%s"); sprintf(b, f%s);' % (first + between, second, rest)
        return Probe(kind, self.body(*out, call, "Serial.println(b);"), before, after)

    def scanned(self):
        """What a scan writes, and what it leaves alone: the neighbour in the array."""
        word, form = self.chance.choice([("long", "%ld"), ("unsigned long", "%lu"), ("int32_t", "%ld"), ("short", "%hd"), ("uint32_t", "%lx"),
                                         ("long", "%li")])
        kind = BOARDS[0].types[word]
        value = self.number_for(kind)
        if form == "%li" or kind.signed:
            value = max(min(value, 30000), -30000) if kind.bits == 16 else value
        text = "%X" % value if form == "%lx" else "%d" % value
        way = self.chance.choice(['sscanf("%s", "%s", &a[1])' % (text, form), 'sscanf("%s", f, &a[1])' % text])
        return Probe("a scan", self.body('const char* f = "%s";' % form, "%s a[3] = {77, 78, 79};" % word, "int n = %s;" % way, "(void)f;",
                                         "Serial.println(n);", *["Serial.println(a[%d]);" % i for i in range(3)]))

    def converted(self):
        long_value = self.of_type("long", 1)
        unsigned_value = self.of_type("unsigned long", 1)
        base = self.chance.choice([2, 8, 10, 16, 36])
        number = self.number_for(BOARDS[0].types["long long"])
        lines = self.chance.choice([
            ['char b[40]; ltoa(%s, b, 10);' % long_value.text, "Serial.println(b);"],
            ['char b[40]; ultoa(%s, b, %d);' % (unsigned_value.text, base), "Serial.println(b);"],
            ['char b[40]; itoa((int)%d, b, 10);' % self.chance.randrange(-32768, 32768), "Serial.println(b);"],
            ['char* end; Serial.println(strtol("%dz", &end, 10)); Serial.println(*end);' % number],
            ['Serial.println(strtoul("%X", 0, 16));' % (abs(number) % (1 << self.chance.choice([8, 16, 31, 32])))],
            ['Serial.println(atol("%d"));' % self.number_for(BOARDS[0].types["long"])],
            ["String s = String(%s);" % long_value.text, "s += ' '; s += %s;" % unsigned_value.text, "Serial.println(s);",
             "Serial.println(s.length());", "Serial.println(s.toInt());"],
            ["String s(%s, %s);" % (unsigned_value.text, self.chance.choice(["HEX", "DEC", "BIN", "OCT"])), "Serial.println(s);"],
            ['String s = "a" + String(%s) + F("b");' % long_value.text, "s.replace(\"b\", \"cc\");", "Serial.println(s);",
             "Serial.println(s.indexOf('c'));", "Serial.println(s.substring(1, 3));"],
            ["Serial.println(map(%d, 0, 1023, %d, %d));" % (self.chance.randrange(1024), self.chance.randrange(-900, 0), self.chance.randrange(1, 30000))],
            ["Serial.println(word(%d, %d));" % (self.chance.randrange(256), self.chance.randrange(256))],
            ["char b[40]; dtostrf(%.3f, %d, %d, b);" % (float(self.dyadic()), self.chance.choice([0, 8, -8]), 3), "Serial.print('['); Serial.print(b);",
             "Serial.println(']');"],
            ["String s(%.3f, 3);" % float(self.dyadic()), "Serial.println(s);", "Serial.println(s.toFloat(), 3);"],
            ["long v = %s;" % long_value.text, "bitSet(v, 3); bitClear(v, 7); bitWrite(v, %d, 1);" % self.chance.randrange(15), "Serial.println(v);"],
        ])
        return Probe("a conversion", self.body(*lines))

    # ---- types ------------------------------------------------------------------------------
    def typed(self):
        """Which function of one name is taken, and how large a thing is."""
        call = self.chance.choice(['atol("5")', "labs(-5L)", "lround(2.5)", "5L", "5UL", "millis()", "random(5)", "map(1L, 2, 3, 4, 5)", "Serial.parseInt()", '"12"',
                                   "2.5f", "true ? 1L : 2L",
                                   "(int64_t)5", "(uint64_t)5", "(int32_t)5", "(uint32_t)5", "(long)5", "(unsigned long)5", "(byte)5", "(int8_t)5",
                                   "(uint16_t)5", "micros()", 'strtol("5", 0, 10)', 'String("7").toInt()', "(char)53", "0x7FFFFFFFL", "pulseIn(3, HIGH, 1)"])
        form = self.chance.randrange(3)
        if form == 0 and not call.startswith(("(byte)", "(int8_t)", "(uint16_t)", "(char)", '"')):
            return Probe("sizeof", self.body("Serial.println((int)sizeof(%s));" % call))
        show = self.name("show")
        sets = self.chance.choice([["long", "unsigned long", "float", "const char*", "byte", "char", "int8_t", "uint16_t"],
                                   ["int64_t", "uint64_t", "int32_t", "uint32_t", "float", "const char*", "byte", "char", "int8_t", "uint16_t"],
                                   ["long", "long long", "unsigned long", "unsigned long long", "double", "float", "const char*", "char", "uint8_t", "int8_t",
                                    "uint16_t"]])
        if form == 2:
            lines = ["template <class T> struct %s { static const char* text() { return \"another\"; } };" % show]
            lines += ["template <> struct %s<%s> { static const char* text() { return \"%s\"; } };" % (show, word, word) for word in sets]
            return Probe("a list of types", self.body("auto it = %s;" % call if not call.startswith('"') else "const char* it = %s;" % call, "(void)it;",
                                                      "Serial.println(%s<decltype(it)>::text());" % show), "\n".join(lines) + "\n")
        heads = ['void %s(%s) { Serial.println(F("%s")); }' % (show, word, word) for word in sets]
        self.chance.shuffle(heads)
        split = self.chance.randrange(len(heads) + 1)
        # Some have a prototype of their author's: the others still need one.
        early = "".join("void %s(%s);\n" % (show, word) for word in sets if self.chance.random() < 0.4)
        return Probe("an overload", self.body("%s(%s);" % (show, call)), early + "\n".join(heads[:split]) + "\n", "\n".join(heads[split:]) + "\n")

    # ---- declarations -----------------------------------------------------------------------
    def declared_function(self):
        """A function that is used before it is written, by a head of some shape."""
        f, kind, mode = self.name("f"), self.name("Kind"), self.name("Mode")
        before = "struct %s { long a; byte b; };\nenum %s { LOW_%d, MIDDLE_%d = 7, HIGH_%d };\n" % (kind, mode, self.number, self.number, self.number)
        value = self.of_type("long", 1).text
        heads = [
            ("long %s(long x) { return x / 3; }", "Serial.println(%s(%s));" % (f, value)),
            ("unsigned long %s(unsigned long x)\n{\n  return x + 1;\n}", "Serial.println(%s(%s));" % (f, value)),
            ("const char* %s(int x) { return x ? \"yes\" : \"no\"; }", "Serial.println(%s(1));" % f),
            ("static long %s(const long& x) { return x - x / 2; }", "Serial.println(%s(%s));" % (f, value)),
            ("struct %s %%s(long x) { struct %s k = {x, 2}; return k; }" % (kind, kind), "Serial.println(%s(%s).a);" % (f, value)),
            ("%s %%s(%s k) { k.b++; return k; }" % (kind, kind), "struct %s k = {1, 255}; Serial.println(%s(k).b);" % (kind, f)),
            ("enum %s %%s(byte x) { return x > 3 ? HIGH_%d : MIDDLE_%d; }" % (mode, self.number, self.number), "Serial.println((int)%s(4));" % f),
            ("void %s(long* x, byte n) { while (n--) *x++ = n; }", "long a[3]; %s(a, 3); Serial.println(a[0]);" % f),
            ("void %s(long (&x)[3]) { x[1] = 70000L; }", "long a[3] = {0}; %s(a); Serial.println(a[1]);" % f),
            ("long %s(long (*g)(long), long x) { return g(x) + 1; }\nlong g" + f + "(long x) { return x / 2; }", "Serial.println(%s(g%s, %s));" % (f, f, value)),
            ("inline byte %s(byte x) { return x << 1; } // { a comment }", "Serial.println(%s(200));" % f),
            ("#if %d\nlong %%s(long x) {\n#else\nlong %%s(long x) {\n#endif\n  return x | 1;\n}" % self.chance.randrange(2), "Serial.println(%s(%s));" % (f, value)),
            ("#ifdef __NEVER__\nint %s() { return 1; }\n#else\nint %s() { return 2; }\n#endif", "Serial.println(%s());" % f),
            ("template <class T> T %s(T x) { return x + x; }", None),
            ("unsigned\nlong\n%s(\n  byte x,  // first\n  byte y   /* second */\n) {\n  return (unsigned long)x << y;\n}", "Serial.println(%s(3, 20));" % f),
            ("boolean %s(String s) { return s == \"}\"; }", "Serial.println(%s(\"}\"));" % f),
            ("char %s(char c) { switch (c) { case '{': return '}'; default: return c; } }", "Serial.println(%s('{'));" % f),
            ("int16_t %s(uint8_t a, ...) { return a; }", "Serial.println(%s(9, 1));" % f),
        ]
        text, call = self.chance.choice(heads)
        text = text.replace("%s", f)
        if call is None:  # a template stands before its use
            return Probe("a template", self.body("Serial.println(%s(%s));" % (f, self.of_type("uint32_t", 1).text)), text + "\n")
        return Probe("a declaration", self.body(call), before, text + "\n")

    def taken_name(self):
        """A name of the C library that the sketch uses for a thing of its own; one name once in a sketch."""
        name = TAKEN[self.number % len(TAKEN)]
        value = self.of_type("long", 1).text
        form = self.chance.randrange(5)
        if form == 0:
            return Probe("a name of the system: a variable", self.body("%s = %s;" % (name, value), "%s += 0;" % name, "Serial.println(%s);" % name),
                         "long %s = 1;\n" % name)
        if form == 1:
            return Probe("a name of the system: a function", self.body("Serial.println(%s(%s, (byte)3));" % (name, value)), "",
                         "long %s(long x, byte y) { return x / y; }\n" % name)
        if form == 2:
            return Probe("a name of the system: a type", self.body("%s s; s.a = %s;" % (name, value), "Serial.println(s.a);"),
                         "struct %s { long a; };\n" % name)
        if form == 3:
            return Probe("a name of the system, in quotes", self.body("%s = 5; SHOW_%d(%s);" % (name, self.number, name)),
                         "long %s;\n#define SHOW_%d(x) Serial.print(#x \"=\"); Serial.println(x)\n" % (name, self.number))
        return Probe("a name of the system: a field and a local", self.body("struct { long %s; } s; s.%s = %s;" % (name, name, value),
                                                                          "long %s = s.%s; Serial.println(%s);" % (name, name, name)))

    def make(self):
        makers = [self.printed] * 5 + [self.of_arduino] * 3 + [self.stored] * 2 + [self.formatted] * 4 + [self.scanned, self.converted, self.converted, self.typed, self.typed,
                                                                                   self.declared_function, self.declared_function, self.taken_name]
        return self.chance.choice(makers)()


def make(seed, number):
    """The same for the same seed and number, whatever else the sketch holds."""
    return Maker(random.Random("%d/%d" % (seed, number)), number).make()
