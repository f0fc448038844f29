// Draws segments with WebGL, as solid beads or as lines, out of one buffer that the whole job has
// from the beginning on.
//
//        up                 z_mm of the move is the top of the bead:
//         ◇  ← normals        top    = z
//   side ◇ ◇                  middle = z − height / 2
//         ◇
//
// A bead is one instance of a bar whose cross-section is a diamond, lit as if it were round: eight
// triangles. A line is an instance of its own two ends, lit as the beads would be on average. Both
// read the same bytes: a range is an offset into them, and every n-th segment is a longer stride.
// The picture is kept, so that new beads are added to it and nothing else is drawn.
//
// A bead of a large part is smaller than a pixel. A normal taken at the pixel's middle, outside of
// the bead, points down, and large parts went dark by that. So the normal is interpolated at the
// centroid of the covered area.
import { createBufferInfoFromArrays, createProgramInfo, drawBufferInfo, setBuffersAndAttributes, setUniforms, type BufferInfo, type ProgramInfo } from 'twgl.js';
import type { Kind } from './pace';
import type { Shade } from './shade';
import { SECTION_AT, SEGMENT_BYTES, thinned, TINT_AT, type Range } from './segments';

const BEADS = `#version 300 es
  in vec3 corner;
  in vec3 start;
  in vec3 end;
  in vec3 tint;
  in vec2 section; // width, height, micrometres
  uniform mat4 matrix;
  centroid out vec3 normal;
  out vec3 colour;
  out float open;
  void main() {
    vec3 along = end - start;
    float far = length(along);
    along = far > 1e-6 ? along / far : vec3(1.0, 0.0, 0.0);
    vec3 side = abs(along.z) < 0.999 ? normalize(cross(along, vec3(0.0, 0.0, 1.0))) : vec3(1.0, 0.0, 0.0);
    vec3 up = cross(side, along);
    vec2 size = section * 0.001;
    normal = side * corner.x + up * corner.y;
    colour = tint;
    // Half a width beyond either end: corners have no notch.
    float reach = mix(-0.35, 0.35, corner.z) * size.x;
    vec3 at = mix(start, end, corner.z) + along * reach
      + side * corner.x * size.x * 0.5 + up * (corner.y - 1.0) * size.y * 0.5;
    open = 1.0 - 0.45 * exp(-0.4 * max(at.z, 0.0));
    gl_Position = matrix * vec4(at, 1.0);
  }`;

// From far away a bead shows the part between its top and the side that faces the viewer.
const LINES = `#version 300 es
  in vec3 corner;
  in vec3 start;
  in vec3 end;
  in vec3 tint;
  uniform mat4 matrix;
  uniform vec3 eye;
  centroid out vec3 normal;
  out vec3 colour;
  out float open;
  void main() {
    vec3 along = end - start;
    float far = length(along);
    along = far > 1e-6 ? along / far : vec3(1.0, 0.0, 0.0);
    vec3 side = abs(along.z) < 0.999 ? normalize(cross(along, vec3(0.0, 0.0, 1.0))) : vec3(1.0, 0.0, 0.0);
    vec3 at = mix(start, end, corner.z);
    normal = cross(side, along) + side * sign(dot(side, eye - at));
    open = 1.0 - 0.45 * exp(-0.4 * max(at.z, 0.0));
    colour = tint * 0.92; // beads have valleys and undersides
    gl_Position = matrix * vec4(at, 1.0);
    gl_Position.z += 2e-5 * gl_Position.w; // beads that are drawn over it later cover it
  }`;

const LIT = `#version 300 es
  precision highp float;
  uniform vec3 sun;
  uniform float share; // of the light; the rest is the ground's
  centroid in vec3 normal;
  in vec3 colour;
  in float open; // share of the sky that is seen from there: the bed covers some of it
  out vec4 pixel;
  vec3 standard(vec3 light) {
    return mix(1.055 * pow(light, vec3(1.0 / 2.4)) - 0.055, light * 12.92, vec3(lessThanEqual(light, vec3(0.0031308))));
  }
  void main() {
    vec3 n = normalize(normal);
    float sky = (0.30 + 0.20 * n.z) * open;
    pixel = vec4(standard(colour * (sky + 0.58 * max(dot(n, sun), 0.0))), 1.0) * share;
  }`;

const PLAIN = `#version 300 es
  in vec3 corner;
  uniform mat4 matrix;
  void main() { gl_Position = matrix * vec4(corner, 1.0); }`;
const FLAT = `#version 300 es
  precision mediump float;
  uniform vec3 colour;
  out vec4 pixel;
  void main() { pixel = vec4(colour, 1.0); }`;

// What the part takes from the bed's light (shade.ts). The page's own ground is behind the canvas.
const SHADED = `#version 300 es
  in vec3 corner; // its z is the share of the light that is taken
  uniform mat4 matrix;
  out float taken;
  void main() {
    taken = corner.z;
    gl_Position = matrix * vec4(corner.xy, 0.0, 1.0);
  }`;
const SHADE = `#version 300 es
  precision mediump float;
  uniform float depth;
  in float taken;
  out vec4 pixel;
  void main() { pixel = vec4(0.0, 0.0, 0.0, depth * taken); }`;

const LENGTH = Math.hypot(0.42, -0.62, 0.66);
export const SUN = [0.42 / LENGTH, -0.62 / LENGTH, 0.66 / LENGTH];

const GHOST_SHARE = 0.3;

/** The bar from z = 0 to z = 1 with corners (±1, 0) and (0, ±1). */
function bar(): { corner: number[]; indices: number[] } {
  const corners = [[1, 0], [0, 1], [-1, 0], [0, -1]];
  const indices = corners.flatMap((_, i) => {
    const [a, b] = [2 * i, 2 * ((i + 1) % 4)];
    return [a, b + 1, b, a, a + 1, b + 1]; // side, up, along are left-handed
  });
  return { corner: corners.flatMap(([x, y]) => [x, y, 0, x, y, 1]), indices };
}

export interface Colours {
  grid: number[];
  outline: number[];
  /** The share of the light that the darkest shade takes from the bed. */
  shade: number;
}

export class Painter {
  private readonly programs: Record<Kind, ProgramInfo>;
  private readonly plain: ProgramInfo;
  private readonly shapes: Record<Kind, BufferInfo>;
  private readonly bed: { grid: BufferInfo; outline: BufferInfo };
  private readonly shaded: ProgramInfo;
  private shade: BufferInfo | null = null;
  private buffer: WebGLBuffer | null = null;
  private readonly pixel = new Uint8Array(4);

  /** `grid`, `outline`: ends of the bed's lines, mm. */
  constructor(private readonly gl: WebGL2RenderingContext, grid: number[], outline: number[]) {
    this.programs = { beads: createProgramInfo(gl, [BEADS, LIT]), lines: createProgramInfo(gl, [LINES, LIT]) };
    this.plain = createProgramInfo(gl, [PLAIN, FLAT]);
    const { corner, indices } = bar();
    this.shapes = {
      beads: createBufferInfoFromArrays(gl, { corner: { numComponents: 3, data: corner }, indices: { numComponents: 3, data: new Uint16Array(indices) } }),
      lines: createBufferInfoFromArrays(gl, { corner: { numComponents: 3, data: [0, 0, 0, 0, 0, 1] } }),
    };
    const lines = (data: number[]) => createBufferInfoFromArrays(gl, { corner: { numComponents: 3, data } });
    this.bed = { grid: lines(grid), outline: lines(outline) };
    this.shaded = createProgramInfo(gl, [SHADED, SHADE]);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    gl.enable(gl.CULL_FACE);
  }

  /** Makes room for a job. */
  begin(segments: number): void {
    const { gl } = this;
    gl.deleteBuffer(this.buffer);
    this.buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, Math.max(1, segments) * SEGMENT_BYTES, gl.STATIC_DRAW);
  }

  /** Brings packed segments to the card, from the place `first` on. */
  put(first: number, packed: ArrayBuffer): void {
    const { gl } = this;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    gl.bufferSubData(gl.ARRAY_BUFFER, first * SEGMENT_BYTES, new Uint8Array(packed));
  }

  /** What the bed is shaded by from now on. */
  shadeBy(from: Shade): void {
    const { gl, shade } = this;
    if (!from.fresh) return;
    for (const buffer of [shade?.attribs?.corner.buffer, shade?.indices]) gl.deleteBuffer(buffer ?? null);
    const { corners, indices } = from.triangles();
    this.shade = indices.length === 0 ? null : createBufferInfoFromArrays(gl, { corner: { numComponents: 3, data: corners }, indices: { numComponents: 3, data: indices } });
  }

  /** Over the bed, and below everything that is drawn later. */
  private drawShade(matrix: Float32Array, depth: number): void {
    const { gl, shade } = this;
    if (!shade) return;
    gl.useProgram(this.shaded.program);
    setBuffersAndAttributes(gl, this.shaded, shade);
    setUniforms(this.shaded, { matrix, depth });
    gl.enable(gl.BLEND);
    gl.disable(gl.DEPTH_TEST);
    drawBufferInfo(gl, shade);
    gl.enable(gl.DEPTH_TEST);
    gl.disable(gl.BLEND);
  }

  /** An empty picture with the bed. */
  clear(width: number, height: number, matrix: Float32Array, colours: Colours): void {
    const { gl } = this;
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.useProgram(this.plain.program);
    for (const name of ['grid', 'outline'] as const) {
      setBuffersAndAttributes(gl, this.plain, this.bed[name]);
      setUniforms(this.plain, { matrix, colour: colours[name] });
      drawBufferInfo(gl, this.bed[name], gl.LINES);
    }
    this.drawShade(matrix, colours.shade);
  }

  /**
   * A pale part, as lines, for what is still to come. It hides nothing: what is drawn later stands
   * in front of it.
   */
  ghost(ranges: Range[], step: number, matrix: Float32Array, eye: number[]): number {
    const { gl } = this;
    gl.depthMask(false);
    const drawn = this.draw('lines', ranges, step, matrix, eye, GHOST_SHARE);
    gl.depthMask(true);
    return drawn;
  }

  /**
   * Adds segments to the picture, every `step`-th of them, about; with `share` of their light.
   * Returns how many.
   */
  draw(kind: Kind, ranges: Range[], step: number, matrix: Float32Array, eye: number[], share = 1): number {
    const { gl } = this;
    const program = this.programs[kind];
    const shape = this.shapes[kind];
    gl.useProgram(program.program);
    setUniforms(program, { matrix, eye, sun: SUN, share });
    let drawn = 0;
    const thin = thinned(ranges, step);
    for (const { first, count } of thin.ranges) {
      const instances = Math.ceil(count / thin.stride);
      const at = (offset: number, numComponents: number, type: number, normalize = false) =>
        ({ buffer: this.buffer!, numComponents, type, normalize, divisor: 1, stride: thin.stride * SEGMENT_BYTES, offset: first * SEGMENT_BYTES + offset });
      const attribs = {
        ...shape.attribs, start: at(0, 3, gl.FLOAT), end: at(12, 3, gl.FLOAT), tint: at(TINT_AT, 3, gl.UNSIGNED_BYTE, true),
        section: at(SECTION_AT, 2, gl.UNSIGNED_SHORT),
      };
      setBuffersAndAttributes(gl, program, { ...shape, attribs });
      drawBufferInfo(gl, shape, kind === 'beads' ? gl.TRIANGLES : gl.LINES, shape.numElements, 0, instances);
      drawn += instances;
    }
    return drawn;
  }

  /** Waits until the card has done all that it was told. */
  finish(): void {
    this.gl.readPixels(0, 0, 1, 1, this.gl.RGBA, this.gl.UNSIGNED_BYTE, this.pixel);
  }
}
