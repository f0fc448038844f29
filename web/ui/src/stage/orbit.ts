// Where the part is looked at from: a camera that goes around a point, and the place from which a
// box fills the picture.
//
//          z  eye = target + distance · (sin p cos a, sin p sin a, cos p)
//          │ p╱     a: azimuth, p: polar, radians
//          │ ╱
//   target ●────── xy
//
// To fit a box is exact. In the camera's axes, from the box's middle, a corner (x, y, z) is at
// (x − u) / ((d − z) t) of the picture's half width, where u is the eye's shift to the right, d its
// distance and t the tangent of half the angle of view. "Left of r, right of l" for all corners is
// u + r t d ≥ max(x + r t z) and u + l t d ≤ min(x + l t z), so the least d is their difference
// over (r − l) t. The same holds upwards; the larger of the two d is taken.
import { m4, v3 } from 'twgl.js';

export interface Box {
  min: number[];
  max: number[];
}
export type Direction = 'corner' | 'top' | 'front';

/** CSS pixels at the picture's edges that other things cover. */
export interface Inset {
  left: number;
  right: number;
  top: number;
  bottom: number;
}

const FIELD = (34 * Math.PI) / 180;
const STEEPEST = 0.002; // straight down has no "up"
const LOWEST = Math.PI * 0.53;
const DISTANCES_MM = [4, 4000] as const;

const anglesOf = (x: number, y: number, z: number): [number, number] => [Math.atan2(y, x), Math.acos(z / Math.hypot(x, y, z))];
const DIRECTIONS: Record<Direction, [azimuth: number, polar: number]> = {
  corner: anglesOf(0.5, -1, 0.66), top: [-Math.PI / 2, STEEPEST], front: anglesOf(0, -1, 0.06),
};

const clamp = (value: number, low: number, high: number): number => Math.min(high, Math.max(low, value));

/** The eye's shift and distance along one axis of the picture; see above. */
function fitAxis(corners: [across: number, depth: number][], tangent: number, low: number, high: number) {
  const most = Math.max(...corners.map(([across, depth]) => across + high * tangent * depth));
  const least = Math.min(...corners.map(([across, depth]) => across + low * tangent * depth));
  return {
    distance: (most - least) / ((high - low) * tangent),
    shift: (distance: number) => (most - high * tangent * distance + least - low * tangent * distance) / 2,
  };
}

export class Orbit {
  target = [0, 0, 0];
  azimuth = DIRECTIONS.corner[0];
  polar = DIRECTIONS.corner[1];
  distance = 300;
  /** A person has turned or moved it since the last look(): it is not framed anew by itself. */
  held = false;
  private width = 1;
  private height = 1;

  resize(width: number, height: number): void {
    this.width = Math.max(1, width);
    this.height = Math.max(1, height);
  }

  /** Looks from `from`, or from where it looks now. */
  look(box: Box, inset: Inset, from?: Direction): void {
    if (from) {
      [this.azimuth, this.polar] = DIRECTIONS[from];
      this.held = false;
    }
    const middle = box.min.map((low, i) => (low + box.max[i]) / 2);
    const [right, up, back] = this.axes();
    const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((n) => v3.subtract([0, 1, 2].map((i) => (n >> i & 1 ? box.max : box.min)[i]), middle));
    const tangent = Math.tan(FIELD / 2);
    const { width, height } = this;
    const along = (axis: v3.Vec3) => corners.map((corner): [number, number] => [v3.dot(corner, axis), v3.dot(corner, back)]);
    const across = fitAxis(along(right), (tangent * width) / height, -1 + (2 * inset.left) / width, 1 - (2 * inset.right) / width);
    const upwards = fitAxis(along(up), tangent, -1 + (2 * inset.bottom) / height, 1 - (2 * inset.top) / height);
    this.distance = clamp(Math.max(across.distance, upwards.distance), ...DISTANCES_MM);
    const [u, v] = [across.shift(this.distance), upwards.shift(this.distance)];
    this.target = middle.map((at, i) => at + u * right[i] + v * up[i]);
  }

  turn(azimuth: number, polar: number): void {
    this.held = true;
    this.azimuth += azimuth;
    this.polar = clamp(this.polar + polar, STEEPEST, LOWEST);
  }

  zoom(by: number): void {
    this.held = true;
    this.distance = clamp(this.distance * by, ...DISTANCES_MM);
  }

  /** By CSS pixels, to the right and downwards. */
  pan(x: number, y: number): void {
    this.held = true;
    const [right, up] = this.axes();
    const mm = (2 * this.distance * Math.tan(FIELD / 2)) / this.height;
    this.target = this.target.map((at, i) => at + mm * (y * up[i] - x * right[i]));
  }

  eye(): number[] {
    const [, , back] = this.axes();
    return this.target.map((at, i) => at + this.distance * back[i]);
  }

  /** From millimetres to the clip space of the graphics card. */
  matrix(): Float32Array {
    const camera = m4.lookAt(this.eye(), this.target, [0, 0, 1]);
    const lens = m4.perspective(FIELD, this.width / this.height, Math.max(0.5, this.distance * 0.04), this.distance + 1500);
    return m4.multiply(lens, m4.inverse(camera)) as Float32Array;
  }

  /** CSS pixels from the upper left corner. */
  project(matrix: Float32Array, x: number, y: number, z: number): [number, number] {
    const w = matrix[3] * x + matrix[7] * y + matrix[11] * z + matrix[15];
    const across = (matrix[0] * x + matrix[4] * y + matrix[8] * z + matrix[12]) / w;
    const up = (matrix[1] * x + matrix[5] * y + matrix[9] * z + matrix[13]) / w;
    return [((across + 1) * this.width) / 2, ((1 - up) * this.height) / 2];
  }

  /** Right, up and towards the viewer, of length 1. */
  private axes(): [v3.Vec3, v3.Vec3, v3.Vec3] {
    const { azimuth: a, polar: p } = this;
    const back = [Math.sin(p) * Math.cos(a), Math.sin(p) * Math.sin(a), Math.cos(p)];
    const right = [-Math.sin(a), Math.cos(a), 0];
    return [right, v3.cross(back, right), back];
  }
}
