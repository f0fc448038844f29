"""Values of C++ expressions as two boards have them: one with an int of 16 bits, one with an int of 32.

A sketch means the same on both boards only where no step depends on the width of int, and where no step is undefined. So
each random expression is worked out twice. Where the two results differ, the difference is the documented one (docs/arduino.md:
an int has 32 bits), and the expression is not used. What is left must print the same everywhere.

The rules are those of C++ (integral promotions, usual arithmetic conversions: ISO/IEC 14882, [conv.prom] and [expr]), in exact
numbers: an int is a Python int, a float is a Fraction that fits into 24 bits.
"""

import fractions
import struct


# avr-gcc divides by these with ADIW behind a skip. simavr 1.6 takes that ADIW for the first half of
# a CALL, and skips the instruction behind it, too: 127 / 32 is 0 there.
SIMAVR_MISTAKES = (16, 32, 64)


class Undefined(Exception):
    """The step is undefined in C++, or it rounds."""


class Type:
    def __init__(self, bits, signed, is_float=False):
        self.bits, self.signed, self.is_float = bits, signed, is_float

    def same(self, other):
        return (self.bits, self.signed, self.is_float) == (other.bits, other.signed, other.is_float)

    def holds(self, value):
        low = -(1 << (self.bits - 1)) if self.signed else 0
        return low <= value < low + (1 << self.bits)

    def wrapped(self, value):
        value &= (1 << self.bits) - 1
        return value - (1 << self.bits) if self.signed and value >> (self.bits - 1) else value


FLOAT = Type(32, True, True)


def as_float(value):
    value = fractions.Fraction(value)
    try:
        single = struct.unpack("f", struct.pack("f", float(value)))[0]
    except OverflowError as error:
        raise Undefined from error
    if fractions.Fraction(single) != value or abs(value) > 1 << 20:
        raise Undefined
    return value


class Board:
    """The types of one board, by the words of a sketch."""

    def __init__(self, int_bits):
        self.int = Type(int_bits, True)
        self.unsigned = Type(int_bits, False)
        self.types = {"int": self.int, "unsigned int": self.unsigned, "float": FLOAT, "double": FLOAT, "bool": Type(8, False)}
        for words, bits, signed in [("char|signed char|int8_t", 8, True), ("byte|uint8_t|unsigned char", 8, False),
                                    ("short|int16_t", 16, True), ("unsigned short|uint16_t", 16, False),
                                    ("long|int32_t|long int|signed long", 32, True), ("unsigned long|uint32_t|unsigned long int", 32, False),
                                    ("long long|int64_t", 64, True), ("unsigned long long|uint64_t", 64, False)]:
            for word in words.split("|"):
                self.types[word] = Type(bits, signed)

    def literal(self, value, suffix, is_hex):
        """The first type that holds it: [lex.icon], table 5."""
        candidates = [Type(bits, signed) for bits in (self.int.bits, 32, 64) for signed in (True, False)]
        for each in candidates:
            if suffix == "U" and each.signed or suffix == "L" and each.bits < 32 or suffix == "UL" and (each.signed or each.bits < 32):
                continue
            if not is_hex and not suffix.startswith("U") and not each.signed:
                continue
            if each.holds(value):
                return each
        raise Undefined

    def promoted(self, kind):
        return kind if kind.is_float or kind.bits >= self.int.bits else self.int

    def common(self, a, b):
        if a.is_float or b.is_float:
            return FLOAT
        a, b = self.promoted(a), self.promoted(b)
        if a.bits != b.bits:
            return a if a.bits > b.bits else b
        return b if a.signed else a

    def convert(self, value, kind):
        if kind.is_float:
            return as_float(value)
        if isinstance(value, fractions.Fraction):
            value = int(value)  # toward zero
            if not kind.holds(value):
                raise Undefined
        return kind.wrapped(value)

    def cast(self, operand, word):
        kind = self.types[word]
        value = operand[1]
        return kind, (int(value != 0) if word == "bool" else self.convert(value, kind))

    def fits(self, value, kind):
        """The result of an operation in `kind`."""
        if kind.is_float:
            return kind, as_float(value)
        if kind.signed and not kind.holds(value):
            raise Undefined
        return kind, kind.wrapped(value)

    def unary(self, sign, operand):
        kind, value = operand
        if sign == "!":
            return Type(8, False), int(value == 0)
        kind = self.promoted(kind)
        value = self.convert(value, kind)
        if sign == "-":
            return self.fits(-value, kind)
        if kind.is_float:
            raise Undefined
        return kind, kind.wrapped(~value)

    def shift(self, sign, left, right):
        kind = self.promoted(left[0])
        value, count = left[1], right[1]
        if kind.is_float or right[0].is_float or not 0 <= count < kind.bits:
            raise Undefined
        if sign == ">>":
            return kind, value >> count
        if value < 0:
            raise Undefined
        return self.fits(value << count, kind)

    def binary(self, sign, left, right):
        if sign in ("&&", "||"):
            a, b = left[1] != 0, right[1] != 0
            return Type(8, False), int(a and b if sign == "&&" else a or b)
        if sign in ("<<", ">>"):
            return self.shift(sign, left, right)
        kind = self.common(left[0], right[0])
        a, b = self.convert(left[1], kind), self.convert(right[1], kind)
        if sign in ("<", ">", "==", "!=", "<=", ">="):
            truth = {"<": a < b, ">": a > b, "==": a == b, "!=": a != b, "<=": a <= b, ">=": a >= b}
            return Type(8, False), int(truth[sign])
        return self.fits(self.arithmetic(sign, a, b, kind), kind)

    @staticmethod
    def arithmetic(sign, a, b, kind):
        if sign in "/%":
            if b == 0 or kind.is_float and sign == "%":
                raise Undefined
            if not kind.is_float and abs(b) in SIMAVR_MISTAKES:
                raise Undefined
            if kind.is_float:
                return a / b
            quotient = abs(a) // abs(b) * (1 if (a < 0) == (b < 0) else -1)
            return quotient if sign == "/" else a - quotient * b
        if sign in "&|^":
            if kind.is_float:
                raise Undefined
            return {"&": a & b, "|": a | b, "^": a ^ b}[sign]
        return {"+": a + b, "-": a - b, "*": a * b}[sign]

    def choice(self, test, left, right):
        kind = left[0] if left[0].same(right[0]) else self.common(left[0], right[0])
        return kind, self.convert((left if test[1] else right)[1], kind)


BOARDS = (Board(16), Board(32))


class Expression:
    """Its text, and its type and value on both boards."""

    def __init__(self, text, on):
        self.text, self.on = text, on

    @staticmethod
    def of(text, work_out):
        """Raises Undefined where the boards differ."""
        on = [work_out(board, index) for index, board in enumerate(BOARDS)]
        if on[0][1] != on[1][1] or on[0][0].is_float != on[1][0].is_float:
            raise Undefined
        return Expression(text, on)

    @property
    def value(self):
        return self.on[0][1]

    @property
    def is_float(self):
        return self.on[0][0].is_float

    @property
    def is_long(self):
        """Its type is one of 32 bits on both boards."""
        return not self.is_float and all(kind.bits == 32 for kind, _ in self.on)

    def binary(self, sign, other):
        return Expression.of("(%s %s %s)" % (self.text, sign, other.text), lambda board, i: board.binary(sign, self.on[i], other.on[i]))

    def unary(self, sign):
        return Expression.of("(%s%s)" % (sign, self.text), lambda board, i: board.unary(sign, self.on[i]))

    def cast(self, word):
        return Expression.of("((%s)%s)" % (word, self.text), lambda board, i: board.cast(self.on[i], word))

    def choice(self, left, right):
        return Expression.of("(%s ? %s : %s)" % (self.text, left.text, right.text),
                             lambda board, i: board.choice(self.on[i], left.on[i], right.on[i]))
