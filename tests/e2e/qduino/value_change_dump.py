"""Reads a value change dump, as IEEE 1364-2005, 18.2 describes it. It shares nothing with what wrote it."""

UNITS_NS = {"s": 10**9, "ms": 10**6, "us": 10**3, "ns": 1}


class Dump:
    """`changes`: for each variable's name its [(ns, value)], in the order of the file. `end_ns`: the last instant that it names."""

    def __init__(self, text):
        words = iter(text.split())
        names, self.changes, self.kinds = {}, {}, {}
        scale, now = None, None
        for word in words:
            if word == "$timescale":
                number, unit = self.until_end(words)
                scale = int(number) * UNITS_NS[unit]
            elif word == "$var":
                kind, width, code, name = self.until_end(words)
                if (kind, width) not in (("wire", "1"), ("real", "64")) or code in names:
                    raise ValueError("a variable is declared wrongly: %s %s %s" % (kind, width, code))
                names[code], self.kinds[name], self.changes[name] = name, kind, []
            elif word in ("$scope", "$upscope", "$enddefinitions"):
                self.until_end(words)
            elif word in ("$dumpvars", "$end"):
                pass
            elif word[0] == "#":
                at = int(word[1:]) * scale
                if now is not None and at < now:
                    raise ValueError("time runs backwards: %d after %d" % (at, now))
                now = at
            elif word[0] in "01xz":
                self.add(names[word[1:]], "wire", now, word[0])
            elif word[0] == "r":
                self.add(names[next(words)], "real", now, float(word[1:]))
            else:
                raise ValueError("what is %r?" % word)
        self.end_ns = now

    def add(self, name, kind, now, value):
        if self.kinds[name] != kind or now is None:
            raise ValueError("%s has no such value" % name)
        self.changes[name].append((now, value))

    @staticmethod
    def until_end(words):
        found = []
        for word in words:
            if word == "$end":
                return found
            found.append(word)
        raise ValueError("a section has no $end")

    def pulses(self, name):
        """[(begin, end)] in ns of each stretch of high that has ended."""
        found, high_since = [], None
        for at, value in self.changes[name]:
            if value == "1" and high_since is None:
                high_since = at
            elif value != "1" and high_since is not None:
                found.append((high_since, at))
                high_since = None
        return found
