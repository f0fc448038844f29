// The part in 3D, as far as it is arithmetic: the camera, the pace, and which segments are shown.
import { describe, expect, it } from 'vitest';
import type { LayerRecord } from '../src/layers';
import { Sketch } from '../src/stage/flat';
import { hull } from '../src/stage/nozzle';
import { Orbit, type Box, type Direction } from '../src/stage/orbit';
import { FRAME_MS, Pace, rest_ms } from '../src/stage/pace';
import { Shade } from '../src/stage/shade';
import { added, countOf, Extent, packSegments, SEGMENT_BYTES, shownRanges, takeFrom, thinned, type Range } from '../src/stage/segments';

/** A generator that gives the same numbers for the same seed (mulberry32). */
function random(seed: number): () => number {
  let a = seed;
  return () => {
    a = (a + 0x6d2b79f5) | 0;
    let t = Math.imul(a ^ (a >>> 15), 1 | a);
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
    return ((t ^ (t >>> 14)) >>> 0) / 4294967296;
  };
}

const record = (layer: number, features: number[], ends: number[][], bytes: number[] = features.map((_, i) => i)): LayerRecord => ({
  layer, part: 0, z_mm: 0.2 * (layer + 1), height_mm: 0.2, segments: features.length, ends: new Float32Array(ends.flat()),
  features: new Uint8Array(features), widths_um: new Uint16Array(features.length), bytes: new Float64Array(bytes),
});

describe('the camera', () => {
  const inset = { left: 10, right: 56, top: 52, bottom: 40 };
  const cornersOf = ({ min, max }: Box) => [0, 1, 2, 3, 4, 5, 6, 7].map((n) => [0, 1, 2].map((i) => (n >> i & 1 ? max : min)[i]));
  it('puts a box into the free part of the picture, and as large as it fits', () => {
    const seed = 29;
    const next = random(seed);
    for (let round = 0; round < 300; round++) {
      const min = [next() * 100, next() * 100, 0];
      const box = { min, max: [min[0] + 5 + 120 * next(), min[1] + 5 + 120 * next(), 1 + 150 * next()] };
      const [width, height] = [330 + 900 * next(), 260 + 500 * next()];
      const orbit = new Orbit();
      orbit.resize(width, height);
      orbit.look(box, inset, (['corner', 'top', 'front'] as Direction[])[round % 3]);
      const seen = cornersOf(box).map(([x, y, z]) => orbit.project(orbit.matrix(), x, y, z));
      const [left, right] = [Math.min(...seen.map(([x]) => x)), Math.max(...seen.map(([x]) => x))];
      const [top, bottom] = [Math.min(...seen.map(([, y]) => y)), Math.max(...seen.map(([, y]) => y))];
      const told = `seed ${seed}, round ${round}`;
      expect(left, told).toBeGreaterThan(inset.left - 0.5);
      expect(right, told).toBeLessThan(width - inset.right + 0.5);
      expect(top, told).toBeGreaterThan(inset.top - 0.5);
      expect(bottom, told).toBeLessThan(height - inset.bottom + 0.5);
      const filled = Math.max((right - left) / (width - inset.left - inset.right), (bottom - top) / (height - inset.top - inset.bottom));
      expect(filled, told).toBeGreaterThan(0.99);
    }
  });
  it('turns, moves and comes nearer, and is then held', () => {
    const orbit = new Orbit();
    orbit.resize(400, 400);
    orbit.look({ min: [0, 0, 0], max: [20, 20, 20] }, inset, 'corner');
    expect(orbit.held).toBe(false);
    const [eye, target, distance] = [orbit.eye(), orbit.target, orbit.distance];
    orbit.turn(0.3, 9);
    expect(orbit.held).toBe(true);
    expect(orbit.eye()).not.toEqual(eye);
    expect(orbit.target).toEqual(target);
    expect(orbit.polar).toBeLessThan(Math.PI * 0.54); // not from below the bed
    orbit.zoom(0.5);
    expect(orbit.distance).toBeCloseTo(distance / 2);
    const [x, y] = orbit.project(orbit.matrix(), target[0], target[1], target[2]);
    orbit.pan(30, -20);
    const [movedX, movedY] = orbit.project(orbit.matrix(), target[0], target[1], target[2]);
    expect([movedX - x, movedY - y].map(Math.round)).toEqual([30, -20]);
    orbit.look({ min: [0, 0, 0], max: [20, 20, 20] }, inset, 'top');
    expect(orbit.held).toBe(false);
  });
});

describe('the pace', () => {
  it('draws so much at once as was measured to fit into a frame', () => {
    const pace = new Pace();
    for (let i = 0; i < 30; i++) pace.note('beads', 1000, 200);
    for (let i = 0; i < 30; i++) pace.note('lines', 1000, 20);
    expect(pace.fits('beads', FRAME_MS)).toBe(200);
    expect(pace.atOnce(150)).toEqual({ kind: 'beads', step: 1 });
    expect(pace.atOnce(1999)).toEqual({ kind: 'lines', step: 1 });
    expect(pace.atOnce(20_000)).toEqual({ kind: 'lines', step: 10 });
  });
  it('ends finer the faster the computer is', () => {
    const slow = new Pace();
    const fast = new Pace();
    for (let i = 0; i < 30; i++) {
      slow.note('beads', 1000, 500);
      slow.note('lines', 1000, 50);
      fast.note('beads', 100_000, 1);
    }
    expect([slow.finest(1000), slow.finest(100_000)]).toEqual(['beads', 'lines']);
    expect([fast.finest(1_000_000), fast.atOnce(1_000_000)]).toEqual(['beads', { kind: 'beads', step: 1 }]);
  });
  it('learns nothing from a few segments', () => {
    const pace = new Pace();
    const before = pace.fits('beads', FRAME_MS);
    pace.note('beads', 10, 5000);
    expect(pace.fits('beads', FRAME_MS)).toBe(before);
  });
  it('rests after a long drawing four times as long, and not at all after a short one', () => {
    expect([rest_ms(3, false), rest_ms(60, false), rest_ms(60, true)]).toEqual([0, 240, 60]);
  });
});

describe('the shown segments', () => {
  const jobs = [record(0, [9, 1, 1], []), record(1, [1, 1], []), record(2, [1, 1], [])];
  jobs[0].bytes = new Float64Array([10, 20, 30]);
  jobs[1].bytes = new Float64Array([40, 50]);
  jobs[2].bytes = new Float64Array([60, 70]);
  it('are those that are laid down, in as few pieces as can be', () => {
    expect(shownRanges(jobs, 0, null)).toEqual([]);
    expect(shownRanges(jobs, 41, null)).toEqual([{ first: 0, count: 4 }]);
    expect(shownRanges(jobs, Infinity, null)).toEqual([{ first: 0, count: 7 }]);
    expect(shownRanges(jobs, Infinity, 1)).toEqual([{ first: 0, count: 3 }]);
  });
  it('of objects that are printed one after the other are several pieces', () => {
    const two = [jobs[0], record(1, [1, 1], [], [40, 50]), record(0, [1, 1], [], [60, 70])];
    expect(shownRanges(two, Infinity, 1)).toEqual([{ first: 0, count: 3 }, { first: 5, count: 2 }]);
  });
  it('grow by what has come, and are drawn anew when something goes', () => {
    const seed = 5;
    const next = random(seed);
    for (let round = 0; round < 500; round++) {
      const many = Array.from({ length: 6 }, (_, i) => record(Math.floor(next() * 3), [1, 1, 1], [], [30 * i, 30 * i + 10, 30 * i + 20]));
      const [a, b] = [next() * 200, next() * 200];
      const [topA, topB] = [next() < 0.5 ? null : Math.floor(next() * 4), next() < 0.5 ? null : Math.floor(next() * 4)];
      const places = (ranges: Range[]) => ranges.flatMap(({ first, count }) => Array.from({ length: count }, (_, i) => first + i));
      const [before, now] = [shownRanges(many, a, topA), shownRanges(many, b, topB)];
      const more = added(before, now);
      if (more === null) continue;
      expect([...places(before), ...places(more)].sort((x, y) => x - y), `seed ${seed}, round ${round}`).toEqual(places(now));
    }
    expect(added([{ first: 0, count: 3 }], [{ first: 0, count: 5 }])).toEqual([{ first: 3, count: 2 }]);
    expect(added([{ first: 0, count: 5 }], [{ first: 0, count: 3 }])).toBeNull();
    expect(added([{ first: 0, count: 5 }], [])).toBeNull();
  });
  it('are drawn in slices that leave nothing out', () => {
    const waiting = [{ first: 0, count: 5 }, { first: 9, count: 4 }];
    expect(takeFrom(waiting, 6)).toEqual([{ first: 0, count: 5 }, { first: 9, count: 1 }]);
    expect(waiting).toEqual([{ first: 10, count: 3 }]);
    expect(takeFrom(waiting, 99)).toEqual([{ first: 10, count: 3 }]);
    expect(waiting).toEqual([]);
  });
  it('are thinned out within the stride that WebGL takes', () => {
    for (const step of [1, 3, 7, 8, 40, 1000]) {
      const { ranges, stride } = thinned([{ first: 10, count: 100_000 }], step);
      expect(stride * SEGMENT_BYTES).toBeLessThanOrEqual(255);
      const drawn = countOf(ranges) / stride;
      expect(drawn).toBeLessThanOrEqual(100_000 / step + 600);
      expect(ranges[0].first).toBe(10);
      expect(ranges.every(({ first, count }) => first + count <= 100_010)).toBe(true);
    }
  });
  it('are packed as the graphics card reads them', () => {
    const one = record(1, [1], [[1, 2, 3, 4, 5, 6]]);
    one.widths_um[0] = 600;
    const bytes = new DataView(packSegments(one));
    expect(bytes.byteLength).toBe(SEGMENT_BYTES);
    expect([0, 4, 8, 12, 16, 20].map((at) => bytes.getFloat32(at, true))).toEqual([1, 2, 3, 4, 5, 6]);
    expect(bytes.getUint8(24)).toBe(Math.floor(255 * 0.88)); // an outer wall, in a darker layer
    expect([bytes.getUint16(28, true), bytes.getUint16(30, true)]).toEqual([600, 200]);
  });
});

describe('where the part lies', () => {
  const line = (x: number, y: number, z: number) => [x, y, z, x + 10, y + 10, z];
  const extent = (...records: LayerRecord[]) => {
    const of = new Extent();
    records.forEach((one) => of.take(one));
    return of.box();
  };
  it('skirt and priming line are beside it', () => {
    expect(extent(record(0, [14, 9, 1], [line(0, 0, 0.2), line(20, 20, 0.2), line(60, 60, 0.2)]), record(1, [1], [line(60, 60, 0.4)]))!.min).toEqual([60, 60, 0]);
  });
  it('a priming line without a name lies in the lowest layer alone', () => {
    const box = extent(record(0, [0, 0, 0], [line(0, 0, 0.2), line(60, 60, 0.2), line(60, 60, 0.4)]));
    expect([box!.min, Math.round(box!.max[2] * 10)]).toEqual([[60, 60, 0], 4]);
  });
  it('a flat part without names is all that there is, and without segments there is none', () => {
    expect(extent(record(0, [0], [line(3, 4, 0.2)]))!.min).toEqual([3, 4, 0]);
    expect(extent()).toBeNull();
  });
});

describe('without 3D', () => {
  it('a picture has some thousands of lines, and no more than are laid down', () => {
    const sketch = new Sketch();
    const many = record(0, Array.from({ length: 20_000 }, () => 1), Array.from({ length: 20_000 }, (_, i) => [i / 200, 0, 0, i / 200, 50, 0]));
    sketch.begin(20_000);
    sketch.add(many);
    const orbit = new Orbit();
    orbit.resize(300, 300);
    const lines = (count: number) => sketch.flat(orbit, orbit.matrix(), [{ first: 0, count }], []).features.length;
    expect([lines(20_000), lines(10_000), lines(0)]).toEqual([5000, 2500, 0]);
  });
  it('an outline is the hull of its points', () => {
    expect(hull([[0, 0], [2, 0], [1, 1], [2, 2], [0, 2], [1, 0.5]]).length).toBe(4);
  });
});

describe('the shade on the bed', () => {
  const bed = { min: [0, 0, 0], max: [100, 100, 0] };
  const sun = [0.42, -0.62, 0.66];
  const square = (z: number): LayerRecord => record(0, [1, 1, 1, 1], [[40, 40, 60, 40], [60, 40, 60, 60], [60, 60, 40, 60], [40, 60, 40, 40]]
    .map(([x, y, toX, toY]) => [x, y, z, toX, toY, z]));
  const shaded = (records: LayerRecord[]) => {
    const shade = new Shade(bed, sun);
    records.forEach((each) => shade.add(each));
    const { corners } = shade.triangles();
    return (x: number, y: number) => {
      for (let i = 0; i < corners.length; i += 3) if (Math.abs(corners[i] - x) <= 1 && Math.abs(corners[i + 1] - y) <= 1) return corners[i + 2];
      return 0;
    };
  };
  it('is darkest at the part, soft around it, and nowhere else', () => {
    const at = shaded([square(0.2)]);
    expect(at(50, 40)).toBeGreaterThan(0.12);
    const outwards = [0, 2, 4, 6].map((mm) => at(50, 39.5 - mm));
    expect(outwards).toEqual([...outwards].sort((a, b) => b - a));
    expect(outwards[1]).toBeGreaterThan(0.04);
    expect(at(50, 20)).toBe(0);
    expect(at(5, 95)).toBe(0);
  });
  it('falls away from the sun, and less from what is higher', () => {
    const low = shaded([square(0.2)]);
    const tall = shaded(Array.from({ length: 60 }, (_, i) => square(0.5 * (i + 1))));
    expect(tall(35, 70)).toBeGreaterThan(low(35, 70) + 0.04);
    expect(tall(65, 32)).toBeLessThan(0.04);
    expect(shaded([square(30)])(50, 40)).toBeLessThan(low(50, 40) / 3);
  });
  it('is none without a part, is made once, and keeps to its bed', () => {
    const shade = new Shade(bed, sun);
    shade.add(record(0, [9, 14], [[20, 20, 0.2, 80, 20, 0.2], [20, 20, 0.2, 20, 80, 0.2]]));
    expect(shade.triangles().indices.length).toBe(0);
    shade.add(record(0, [1, 1], [[-500, 50, 1, 900, 50, 1], [NaN, 0, 1, 10, 10, 1]]));
    expect(shade.fresh).toBe(true);
    const { corners, indices } = shade.triangles();
    expect(Math.max(...indices)).toBe(corners.length / 3 - 1);
    expect(indices.length).toBeGreaterThan(0);
    expect(shade.fresh).toBe(false);
    shade.clear();
    expect(shade.triangles().indices.length).toBe(0);
    expect(new Shade({ min: [0, 0, 0], max: [2000, 400, 0] }, sun).width).toBeLessThanOrEqual(160);
  });
});
