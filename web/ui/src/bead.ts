// Extrusions as solid beads: one instance a segment of a bar whose cross-section is a diamond, lit
// as if it were round.
//
//        up                 z_mm of the move is the top of the bead:
//         ◇  ← normals        top    = z
//   side ◇ ◇                  middle = z − height / 2
//         ◇
//
// Eight triangles a segment. Above BEADS_MAX segments the view draws lines instead, lit as the
// beads would be on average. So a job of millions of segments is still drawn at once.
//
// A bead of a large part is smaller than a pixel. A normal taken at the pixel's middle, outside of
// the bead, points down, and large parts went dark by that. So the normal is interpolated at the
// centroid of the covered area.
import {
  BufferAttribute, BufferGeometry, InstancedBufferAttribute, InstancedBufferGeometry, InstancedInterleavedBuffer, InterleavedBufferAttribute,
  ShaderMaterial, Vector3,
} from 'three';
import type { LayerRecord } from './layers';

export const BEADS_MAX = 400_000;

const VERTEX = `
  attribute vec3 start;
  attribute vec3 end;
  attribute vec3 tint;
  attribute vec2 section; // width, height, mm
  centroid varying vec3 vNormal3;
  varying vec3 vTint;
  void main() {
    vec3 along = end - start;
    float far = length(along);
    along = far > 1e-6 ? along / far : vec3(1.0, 0.0, 0.0);
    vec3 side = abs(along.z) < 0.999 ? normalize(cross(along, vec3(0.0, 0.0, 1.0))) : vec3(1.0, 0.0, 0.0);
    vec3 up = cross(side, along);
    vNormal3 = side * position.x + up * position.y;
    vTint = tint;
    // Half a width beyond either end: corners have no notch.
    float reach = mix(-0.35, 0.35, position.z) * section.x;
    vec3 at = mix(start, end, position.z) + along * reach
      + side * position.x * section.x * 0.5 + up * (position.y - 1.0) * section.y * 0.5;
    gl_Position = projectionMatrix * modelViewMatrix * vec4(at, 1.0);
  }`;

// From far away a bead shows the part between its top and the side that faces the viewer.
const THIN_VERTEX = `
  attribute vec3 along;
  attribute vec3 tint;
  centroid varying vec3 vNormal3;
  varying vec3 vTint;
  void main() {
    vec3 side = abs(along.z) < 0.999 ? normalize(cross(along, vec3(0.0, 0.0, 1.0))) : vec3(1.0, 0.0, 0.0);
    vNormal3 = cross(side, along) + side * sign(dot(side, cameraPosition - position));
    vTint = tint * 0.92; // beads have valleys and undersides
    gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
  }`;

const FRAGMENT = `
  uniform vec3 sun;
  centroid varying vec3 vNormal3;
  varying vec3 vTint;
  void main() {
    vec3 n = normalize(vNormal3);
    float sky = 0.30 + 0.20 * n.z;
    float direct = max(dot(n, sun), 0.0);
    gl_FragColor = vec4(vTint * (sky + 0.58 * direct), 1.0);
    #include <colorspace_fragment>
  }`;

/** The bar from z = 0 to z = 1 with corners (±1, 0) and (0, ±1). */
function bar(): { corners: BufferAttribute; index: BufferAttribute } {
  const corners = [[1, 0], [0, 1], [-1, 0], [0, -1]];
  const positions = corners.flatMap(([x, y]) => [x, y, 0, x, y, 1]);
  const index = corners.flatMap((_, i) => {
    const [a, b] = [2 * i, 2 * ((i + 1) % 4)];
    return [a, b + 1, b, a, a + 1, b + 1]; // side, up, along are left-handed
  });
  return { corners: new BufferAttribute(new Float32Array(positions), 3), index: new BufferAttribute(new Uint16Array(index), 1) };
}

const material = (vertexShader: string): ShaderMaterial => new ShaderMaterial({
  vertexShader, fragmentShader: FRAGMENT, uniforms: { sun: { value: new Vector3(0.42, -0.62, 0.66).normalize() } },
});
export const beadMaterial = (): ShaderMaterial => material(VERTEX);
/** For the lines of thinGeometry(), as bright as the beads would be. */
export const thinMaterial = (): ShaderMaterial => material(THIN_VERTEX);

/**
 * Lines along the tops of the beads, each vertex with its direction. Draw fewer by the draw range:
 * two vertices a segment.
 */
export function thinGeometry(record: LayerRecord, tints: Uint8Array): BufferGeometry {
  const along = new Int8Array(record.segments * 8);
  const both = new Uint8Array(record.segments * 8);
  for (let i = 0; i < record.segments; i++) {
    const [x, y, z] = [0, 1, 2].map((axis) => record.ends[6 * i + 3 + axis] - record.ends[6 * i + axis]);
    const scale = 127 / (Math.hypot(x, y, z) || 1);
    for (const at of [8 * i, 8 * i + 4]) {
      along.set([x * scale, y * scale, z * scale], at);
      both.set(tints.subarray(4 * i, 4 * i + 4), at);
    }
  }
  return new BufferGeometry()
    .setAttribute('position', new BufferAttribute(record.ends, 3))
    .setAttribute('along', new BufferAttribute(along, 4, true))
    .setAttribute('tint', new BufferAttribute(both, 4, true));
}

/** One instance a segment; `tints` are RGBA bytes, one a segment. Draw fewer by instanceCount. */
export function beadGeometry(record: LayerRecord, tints: Uint8Array): InstancedBufferGeometry {
  const geometry = new InstancedBufferGeometry();
  const { corners, index } = bar();
  geometry.setIndex(index);
  geometry.setAttribute('position', corners);
  const ends = new InstancedInterleavedBuffer(record.ends, 6, 1);
  geometry.setAttribute('start', new InterleavedBufferAttribute(ends, 3, 0));
  geometry.setAttribute('end', new InterleavedBufferAttribute(ends, 3, 3));
  geometry.setAttribute('tint', new InstancedBufferAttribute(tints, 4, true));
  const section = new Float32Array(record.segments * 2);
  for (let i = 0; i < record.segments; i++) {
    section[2 * i] = record.widths_um[i] > 0 ? record.widths_um[i] / 1000 : 0.45;
    section[2 * i + 1] = record.height_mm > 0 ? record.height_mm : 0.2;
  }
  geometry.setAttribute('section', new InstancedBufferAttribute(section, 2));
  return geometry;
}
