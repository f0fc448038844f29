// The mock's jobs: records in the form of docs/api.md, and their list in pages.

const WAITING = ['queued', 'held'];
const ENDED = ['done', 'cancelled', 'failed'];
export const isEnded = (job) => ENDED.includes(job.state);
export const isWaiting = (job) => WAITING.includes(job.state);

export function makeJob(part, estimated_s, id, name, state, more = {}) {
  return {
    id, name, size: part.size, sha256: '0'.repeat(64), state, hold: state === 'held', copies: 1, copies_done: 0, priority: 0,
    position: null, created: '2026-11-21T06:00:00Z', started: null, ended: null, error: null, stopped_line: null, stopped_layer: null, stopped_byte: null, printed_s: null,
    facts: {
      estimated_s, filament_mm: 3918.2, layers: part.layers.length, lines: Math.round(part.size / 34), min_mm: [40, 40, 0.3], max_mm: [110, 110, 36],
      activities_s: {
        outer_wall: estimated_s * 0.31, inner_wall: estimated_s * 0.2, sparse_infill: estimated_s * 0.24, solid_infill: estimated_s * 0.08,
        travel: estimated_s * 0.11, retraction: estimated_s * 0.02, homing: 12, heating: 150,
      },
      slicer_s: estimated_s * 0.92, hot_end_c: 209, bed_c: 60, slicer: 'PrusaSlicer 2.5.0', thumbnail: false, warnings: [],
    },
    progress: { bytes: 0, fraction: 0, elapsed_s: 0, remaining_s: null }, ...more,
  };
}

/**
 * `count` ended jobs as a printer has them after years: most were printed, some were cancelled, a
 * few failed.
 */
export function makeHistory(count, make) {
  const names = ['bracket', 'cable-clip', 'gear', 'hinge', 'hook', 'knob', 'lid', 'spacer'];
  const out = [];
  for (let id = count; id > 0; id--) {
    const state = id % 50 === 7 ? 'failed' : id % 20 === 3 ? 'cancelled' : 'done';
    const started = Date.UTC(2026, 10, 21) - (count - id) * 3_600_000;
    const time = (ms) => new Date(ms).toISOString().replace('.000', '');
    const stop = state === 'done' ? {} : { stopped_line: 1000 + id % 7000, stopped_layer: 1 + id % 100, stopped_byte: (1000 + id % 7000) * 34 };
    out.push(make(id, `${names[id % names.length]}-${id}.gcode`, state, {
      started: time(started), ended: time(started + 2_000_000), printed_s: 2000, ...stop, ...(state === 'failed' ? { error: 'emergency stop' } : {}),
    }));
    out[out.length - 1].facts.thumbnail = id % 2 === 0;
  }
  return out;
}

export function countsOf(jobs) {
  const counts = { queued: 0, held: 0, printing: 0, done: 0, cancelled: 0, failed: 0, total: jobs.length };
  for (const { state } of jobs) counts[state === 'paused' ? 'printing' : state]++;
  return counts;
}

/**
 * One page of `jobs`, which stand in their order: running, waiting, ended. `first`: how much of
 * each the first page has.
 */
export function pageOf(jobs, { limit, before, states, text }, first) {
  const plain = before === null && states.length === 0 && !text;
  const from = before === null ? 0 : jobs.findIndex((job) => job.id === before) + 1;
  const matching = jobs.slice(from).filter((job) => (states.length === 0 || states.includes(job.state))
    && (!text || job.name.toLowerCase().includes(text.toLowerCase())));
  const head = plain ? [...jobs.filter((job) => !isEnded(job) && !isWaiting(job)), ...jobs.filter(isWaiting).slice(0, first.waiting)] : [];
  const rest = plain ? matching.filter(isEnded) : matching;
  const page = rest.slice(0, limit);
  return { jobs: [...head, ...page], next_before: rest.length > page.length ? page[page.length - 1].id : null };
}

export const inspectionOf = () => ({
  completed: true, matches: true, differences: [], layer_count: 120, duration_s: 4821, lost_steps: { x: 0, y: 0, z: 0, e: 0 },
  path_deviation_mm_max: { x: 0.0063, y: 0.0062, z: 0.0003, e: 0.005 }, filament_mm: { asked: 3918.2, built: 3918.19 },
});
