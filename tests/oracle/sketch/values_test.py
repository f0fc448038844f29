"""Holds values.py against results that the C++ standard's rules give by hand, for an int of 16 bits and of 32."""

import unittest

from values import BOARDS, FLOAT, Expression, Undefined

SMALL, LARGE = BOARDS


def of(word, value):
    return Expression(str(value), [(board.types[word], value) for board in BOARDS])


class Values(unittest.TestCase):
    def test_what_depends_on_the_width_of_int_is_no_question(self):
        for left, sign, right in [(of("int", 300), "*", of("int", 200)), (of("uint16_t", 1), "-", of("byte", 2)),
                                  (of("uint16_t", 65535), ">", of("int16_t", -1)), (of("int", 1), "<<", of("byte", 15))]:
            with self.assertRaises(Undefined, msg=sign):
                left.binary(sign, right)
        with self.assertRaises(Undefined):
            of("uint16_t", 5).unary("~")  # 65530 and -6

    def test_what_does_not_is_worked_out(self):
        for left, sign, right, value in [(of("byte", 200), "+", of("byte", 100), 300), (of("long", -7), "/", of("int", 2), -3),
                                         (of("long", -7), "%", of("int", 2), -1), (of("int8_t", -128), ">>", of("byte", 1), -64),
                                         (of("unsigned long", 0), "-", of("int", 1), 0xFFFFFFFF), (of("long", -1), ">", of("unsigned long", 7), 1),
                                         (of("int64_t", -1), ">", of("uint32_t", 7), 0), (of("char", 97), "^", of("bool", 1), 96)]:
            self.assertEqual(left.binary(sign, right).value, value, (left.text, sign, right.text))

    def test_an_overflow_and_a_rounded_float_are_no_questions(self):
        for left, sign, right in [(of("long", 2147483647), "+", of("int", 1)), (of("long", 5), "/", of("byte", 0)), (of("long", 1), "<<", of("byte", 32))]:
            with self.assertRaises(Undefined):
                left.binary(sign, right)
        tenth = Expression("0.5", [(FLOAT, SMALL.convert(1, FLOAT) / 2)] * 2).binary("/", of("int", 4))
        self.assertEqual(float(tenth.value), 0.125)
        with self.assertRaises(Undefined):
            tenth.binary("/", of("int", 5))

    def test_casts_and_choices(self):
        self.assertEqual(of("long", 300).cast("byte").value, 44)
        self.assertEqual(of("long", 200).cast("int8_t").value, -56)
        self.assertEqual(of("long", -1).cast("unsigned long").value, 4294967295)
        self.assertEqual(of("bool", 1).choice(of("byte", 5), of("long", -70000)).value, 5)
        self.assertTrue(of("bool", 0).choice(of("byte", 5), of("long", -70000)).is_long)

    def test_numbers_have_the_first_type_that_holds_them(self):
        self.assertEqual([board.literal(40000, "", False).bits for board in BOARDS], [32, 32])
        self.assertEqual([(board.literal(0x8000, "", True).bits, board.literal(0x8000, "", True).signed) for board in BOARDS], [(16, False), (32, True)])
        self.assertEqual([board.literal(5, "L", False).bits for board in BOARDS], [32, 32])
        self.assertEqual([board.literal(4294967295, "", False).bits for board in BOARDS], [64, 64])


if __name__ == "__main__":
    unittest.main()
