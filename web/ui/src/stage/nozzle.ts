// The nozzle above the part, on a canvas of its own, so that the picture of the part stays as it is
// while the nozzle moves. It is drawn as the outlines of a cone and of a block.
import type { Orbit } from './orbit';

type Point = [x: number, y: number];
const AROUND = 20;
const TIP_MM = 4.5;
const TIP_RADIUS_MM = 2.2;
const BLOCK_RADIUS_MM = 4;
export const NOZZLE_MM = TIP_MM + 6;

/** The corners of the convex hull (Andrew's monotone chain). */
export function hull(points: Point[]): Point[] {
  const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const half = (from: Point[]) => {
    const out: Point[] = [];
    for (const p of from) {
      for (let n = out.length; n > 1; n = out.length) {
        const [a, b] = [out[n - 2], out[n - 1]];
        if ((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) > 0) break;
        out.pop();
      }
      out.push(p);
    }
    return out.slice(0, -1);
  };
  return [...half(sorted), ...half(sorted.reverse())];
}

const COLOURS = { brass: ['#f0c46a', '#9a6f1f'], steel: ['#a9bccd', '#62788c'] } as const;

/** Draws it with its tip at `at`, or not at all where it would be cut by an edge. */
export function drawNozzle(context: OffscreenCanvasRenderingContext2D, orbit: Orbit, matrix: Float32Array, at: number[], width: number, height: number): void {
  const ring = (radius: number, up: number) => Array.from({ length: AROUND }, (_, i): Point => {
    const a = (2 * Math.PI * i) / AROUND;
    return orbit.project(matrix, at[0] + radius * Math.cos(a), at[1] + radius * Math.sin(a), at[2] + up);
  });
  const tip = hull([orbit.project(matrix, at[0], at[1], at[2]), ...ring(TIP_RADIUS_MM, TIP_MM)]);
  const lid = ring(BLOCK_RADIUS_MM, NOZZLE_MM);
  const block = hull([...ring(BLOCK_RADIUS_MM, TIP_MM), ...lid]);
  const inside = ([x, y]: Point) => x >= 0 && y >= 0 && x <= width && y <= height;
  if (![...tip, ...block].every(inside)) return;
  const fill = (points: Point[], colour: string | CanvasGradient) => {
    context.beginPath();
    points.forEach(([x, y], i) => (i === 0 ? context.moveTo(x, y) : context.lineTo(x, y)));
    context.closePath();
    context.fillStyle = colour;
    context.fill();
  };
  const shaded = (points: Point[], [light, dark]: readonly [string, string]) => {
    const across = points.map(([x]) => x);
    const gradient = context.createLinearGradient(Math.min(...across), 0, Math.max(...across), 0);
    gradient.addColorStop(0.25, light);
    gradient.addColorStop(1, dark);
    fill(points, gradient);
  };
  context.globalAlpha = 0.9;
  shaded(tip, COLOURS.brass);
  context.globalAlpha = 0.8;
  shaded(block, COLOURS.steel);
  fill(hull(lid), COLOURS.steel[0]);
  context.globalAlpha = 1;
}
