// What a refusal was about. It ends when that has changed: "Nothing is printing" must not stand
// under the next print. Pure.
import { isRunning, type State } from './store';

const jobOf = (state: State, id: number) =>
  [state.jobs, state.older, state.found?.jobs ?? []].flat().find((job) => job.id === id);

/** What the machine is about: its state, its print and its fault. */
function machineOf({ status, jobs, online }: State): unknown[] {
  return [online, status?.state, status?.fault, status?.session, jobs.find(isRunning)?.id];
}

/**
 * The circumstances of what was asked for at `place`, as a text to be compared: while it is the
 * same, the refusal stands.
 */
export function circumstances(state: State, place: string): string {
  const { status, gate, config, online } = state;
  const [, id] = /^job-(\d+)$/.exec(place) ?? [];
  if (id !== undefined) {
    const job = jobOf(state, Number(id));
    return JSON.stringify([online, job?.state, job?.position, job?.copies, job?.copies_done]);
  }
  switch (place) {
    case 'queue': case 'bed': return JSON.stringify([online, gate.held, gate.reason, gate.bed_occupied, state.jobs.find(isRunning)?.id]);
    case 'jog': {
      const warm = (status?.hot_end.c ?? 0) >= (config?.hot_end.min_extrude_c ?? 170);
      return JSON.stringify([machineOf(state), status?.homed, status?.may_jog, warm]);
    }
    case 'hot_end_c': return JSON.stringify([machineOf(state), status?.hot_end.target_c]);
    case 'bed_c': return JSON.stringify([machineOf(state), status?.bed.target_c]);
    case 'fan': return JSON.stringify([machineOf(state), status?.fan]);
    default: return JSON.stringify(machineOf(state));
  }
}
