// A synthetic part as packed layers (printer/preflight/layer_packer.h): a lobed vase with walls,
// infill and a skirt. Byte offsets rise with every segment, as they would in a job's file.

const MAGIC = 0x314c4451;
const OUTER_WALL = 1, INNER_WALL = 2, SPARSE_INFILL = 4, SOLID_INFILL = 5, SKIRT = 9;
const BYTES_A_LINE = 34;

const ring = (cx, cy, z, radius, lobes, depth, points = 120) =>
  Array.from({ length: points + 1 }, (_, i) => {
    const a = (2 * Math.PI * i) / points + z / 18;
    const r = radius * (1 + depth * Math.cos(lobes * a));
    return [cx + r * Math.cos(a), cy + r * Math.sin(a)];
  });

/** Straight lines, turned by a right angle on every other layer, clipped to a circle. */
function infill(cx, cy, radius, spacing, turned) {
  const lines = [];
  for (let d = -radius + spacing; d < radius; d += spacing) {
    const half = Math.sqrt(radius * radius - d * d);
    const ends = turned ? [[cx + d, cy - half], [cx + d, cy + half]] : [[cx - half, cy + d], [cx + half, cy + d]];
    lines.push(lines.length % 2 ? ends.reverse() : ends);
  }
  return lines;
}

function polylines(layer, layers) {
  const z = 0.3 * (layer + 1);
  const radius = 22 + 7 * Math.sin((layer / layers) * Math.PI * 1.35);
  const solid = layer < 3 || layer >= layers - 3;
  const out = [];
  if (layer === 0) out.push({ feature: SKIRT, points: ring(75, 75, 0, 36, 6, 0) });
  out.push({ feature: INNER_WALL, points: ring(75, 75, z, radius - 0.5, 6, 0.07) });
  out.push({ feature: OUTER_WALL, points: ring(75, 75, z, radius, 6, 0.07) });
  for (const points of infill(75, 75, radius * 0.92 - 1, solid ? 0.9 : 4, layer % 2 === 1)) {
    out.push({ feature: solid ? SOLID_INFILL : SPARSE_INFILL, points });
  }
  return { z, lines: out };
}

function pack(layer, z, lines, firstByte) {
  const vertices = lines.reduce((n, line) => n + line.points.length, 0);
  const buffer = Buffer.alloc(40 + vertices * 20);
  let byte = 0;
  let at = 40;
  for (const { feature, points } of lines) {
    points.forEach(([x, y], i) => {
      buffer.writeFloatLE(x, at);
      buffer.writeFloatLE(y, at + 4);
      buffer.writeFloatLE(z, at + 8);
      buffer.writeUInt8(feature, at + 12);
      buffer.writeUInt8(i === 0 ? 1 : 0, at + 13);
      buffer.writeUInt16LE(450, at + 14);
      buffer.writeUInt32LE(byte, at + 16);
      byte += BYTES_A_LINE;
      at += 20;
    });
  }
  [MAGIC, layer, 0].forEach((value, i) => buffer.writeUInt32LE(value, 4 * i));
  buffer.writeFloatLE(z, 12);
  buffer.writeFloatLE(0.3, 16);
  buffer.writeUInt32LE(vertices, 20);
  buffer.writeUInt32LE(vertices - lines.length, 24);
  buffer.writeDoubleLE(firstByte, 32);
  return { buffer, bytes: byte };
}

/**
 * {size, layers: [{index, layer, z_mm, segments, bytes, first_byte, buffer}], at(byte) → position
 * of the head}
 */
export function makePart(count = 120) {
  const layers = [];
  const path = [];
  let size = 900; // what stands before the first layer
  for (let layer = 0; layer < count; layer++) {
    const { z, lines } = polylines(layer, count);
    const { buffer, bytes } = pack(layer, z, lines, size);
    lines.forEach((line) => line.points.forEach(([x, y]) => path.push([x, y, z, layer])));
    layers.push({ index: layer, layer, z_mm: z, segments: buffer.readUInt32LE(24), bytes: buffer.length, first_byte: size, buffer });
    size += bytes;
  }
  const at = (byte) => path[Math.max(0, Math.min(path.length - 1, Math.floor((byte - 900) / BYTES_A_LINE)))];
  return { size, layers, at };
}

/**
 * A cube on the middle of the bed: two walls, and infill that is closed below and above. `step`:
 * the length of the pieces of its lines.
 */
export function makeCube(edge, step = edge) {
  const height = Math.round(edge / 0.3);
  const low = 75 - edge / 2, high = 75 + edge / 2;
  const square = (in_mm) => [[low + in_mm, low + in_mm], [high - in_mm, low + in_mm], [high - in_mm, high - in_mm], [low + in_mm, high - in_mm], [low + in_mm, low + in_mm]];
  const layers = [];
  let size = 900;
  for (let layer = 0; layer < height; layer++) {
    const solid = layer < 3 || layer >= height - 3;
    const lines = [{ feature: INNER_WALL, points: square(0.67) }, { feature: OUTER_WALL, points: square(0.22) }];
    for (let at = low + 1; at < high - 1; at += solid ? 0.45 : 4) {
      lines.push({ feature: solid ? SOLID_INFILL : SPARSE_INFILL, points: layer % 2 ? [[at, low + 1], [at, high - 1]] : [[low + 1, at], [high - 1, at]] });
    }
    const cut = lines.map(({ feature, points }) => ({ feature, points: inPieces(points, step) }));
    const { buffer, bytes } = pack(layer, 0.3 * (layer + 1), cut, size);
    layers.push({ index: layer, layer, z_mm: 0.3 * (layer + 1), segments: buffer.readUInt32LE(24), bytes: buffer.length, first_byte: size, buffer });
    size += bytes;
  }
  return { size, layers, min_mm: [low, low, 0.3], max_mm: [high, high, edge] };
}

function inPieces(points, step) {
  const out = [points[0]];
  for (let i = 1; i < points.length; i++) {
    const [[x, y], [toX, toY]] = [points[i - 1], points[i]];
    const pieces = Math.max(1, Math.ceil(Math.hypot(toX - x, toY - y) / step));
    for (let piece = 1; piece <= pieces; piece++) out.push([x + ((toX - x) * piece) / pieces, y + ((toY - y) * piece) / pieces]);
  }
  return out;
}
