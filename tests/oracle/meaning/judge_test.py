"""Does the judge see what it is there for? Ideal steps are made of a description, without any printer, and spoiled in the
ways in which printers have been wrong. The judge must accept the former and refuse each of the latter."""

import random
import sys

import generator
import intent
import judge


def ideal_steps(pieces, start=(0.0, 0.0, 0.0, 0.0), fixed_speed=20.0):
    """Steps of a machine that goes exactly the way that is meant, and waits nowhere."""
    at, place, time, steps = list(start), [0, 0, 0, 0], 0, []
    for piece in pieces:
        end = [at[i] if piece.end[i] is None else piece.end[i] for i in range(4)]
        length = max(sum((end[i] - at[i]) ** 2 for i in range(3)) ** 0.5, abs(end[3] - at[3]))
        speed = getattr(piece, "speed", None) or fixed_speed
        for i in range(3):
            if abs(end[i] - at[i]) > 1e-9:
                speed = min(speed, judge.LARGEST_SPEED[i] * length / abs(end[i] - at[i]))
        count = max(1, int(length / 0.0004))
        for k in range(1, count + 1):
            time += int(length / speed / count * 1e9)
            for i in range(4):
                whole = round((at[i] + (end[i] - at[i]) * k / count) * judge.STEPS_PER_MM[judge.AXES[i]])
                while place[i] != whole:
                    sign = 1 if whole > place[i] else -1
                    place[i] += sign
                    steps.append((time, i, sign))
        at = end
    return steps


def flat(pieces):
    """Without the lift at the end, as where it is lost behind an object that is left out."""
    top = pieces[-1].end[2]
    below = max((p.end[2] for p in pieces if p.end[2] is not None and p.end[2] < top - 0.5), default=None)
    if below is None:
        return None
    return [type(p)((p.end[0], p.end[1], below if p.end[2] == top else p.end[2], p.end[3])) for p in pieces]


def without_circle(pieces):
    """Its filament is pushed in one place."""
    for k in range(len(pieces) - 12):
        run = pieces[k : k + 12]
        if all(isinstance(p, intent.Straight) and p.speed is None for p in run) and run[0].end[:2] != run[-1].end[:2]:
            return pieces[:k] + [intent.Straight((*run[0].end[:3], run[-1].end[3]))] + pieces[k + 12 :]
    return None


def more_filament(pieces):
    last = pieces[-1].end[3]
    if not last or last < 1:
        return None
    return [type(p)((*p.end[:3], None if p.end[3] is None else p.end[3] * 1.3)) for p in pieces]


def slower(pieces):
    if not any(isinstance(p, intent.Straight) and p.speed and p.speed >= 60 for p in pieces):
        return None
    return [intent.Straight(p.end, p.speed * 0.9) if isinstance(p, intent.Straight) and p.speed else p for p in pieces]


def cut(pieces):
    return pieces[: len(pieces) // 2] if len(pieces) > 6 else None


SPOILED = (flat, without_circle, more_filament, slower, cut)


def main():
    wrong, seen = 0, dict.fromkeys((each.__name__ for each in SPOILED), 0)
    for seed in range(5):
        pieces = generator.Print(random.Random(seed)).pieces
        said = judge.judge(ideal_steps(pieces), pieces)
        if said:
            wrong += 1
            print("seed %d: ideal steps are refused: %s" % (seed, said))
        for spoil in SPOILED:
            spoiled = spoil(pieces)
            if spoiled is None:
                continue
            seen[spoil.__name__] += 1
            if judge.judge(ideal_steps(spoiled), pieces) is None:
                wrong += 1
                print("seed %d: the judge does not see: %s" % (seed, spoil.__name__))
    print("tried: " + ", ".join("%s %d" % each for each in seen.items()))
    return 1 if wrong or not all(seen.values()) else 0


if __name__ == "__main__":
    sys.exit(main())
