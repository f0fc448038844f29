"""What every random comparison asks of its command line, and the seeds that it goes through."""

import pathlib
import time


def add_options(parser, count):
    """`count`: of trials, where no time is said."""
    parser.add_argument("--seconds", type=float, default=0)
    parser.add_argument("--count", type=int, default=count)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=pathlib.Path)
    parser.add_argument("--first", action="store_true")


def seeds(options):
    """From --seed on, until --seconds are over, or --count of them."""
    until = time.monotonic() + options.seconds
    seed = options.seed
    while time.monotonic() < until if options.seconds else seed < options.seed + options.count:
        yield seed
        seed += 1
