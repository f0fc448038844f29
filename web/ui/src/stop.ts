// The emergency stop of the page. A person who has pressed it must know whether it was obeyed, so
// it is never said to be done because a request was sent. It is confirmed when the service has
// taken it, and when the machine, asked after that, says that it has stopped.
//
//     pressed ──► asked ──► the service answers ──► the machine is "faulted" ──► confirmed
//                   │ no answer in TRY_MS, or the machine does not say so
//                   ▼
//              unconfirmed: "cut the power" ── again and again ──► confirmed
import { apply, request } from './api';
import { store, type Stop } from './store';
import type { Status } from './types';

export const TRY_MS = 2000;
const AGAIN_MS = 500;
const LOOK_MS = 50;
/** A status that was on its way while the stop was obeyed is of before. */
const SETTLES_MS = 3000;

let presses = 0;
let forget = () => {};

const after = (ms: number) => new Promise<void>((resolve) => { setTimeout(resolve, ms); });

const say = (stop: Stop | null): void => store.set({ stop });

/** Asks the machine until it says that it stands, for TRY_MS. */
async function hasStopped(): Promise<boolean> {
  const until_ms = performance.now() + TRY_MS;
  while (performance.now() < until_ms) {
    const status = await request<Status>('GET', 'machine', undefined, { patience_ms: until_ms - performance.now() });
    if (status.state === 'faulted') {
      apply({ type: 'status', status });
      return true;
    }
    await after(LOOK_MS);
  }
  return false;
}

/** What was tried, in words; null: it has stopped. */
async function attempt(): Promise<string | null> {
  try {
    await request('POST', 'machine/emergency-stop', undefined, { patience_ms: TRY_MS, urgent: true });
  } catch (error) {
    return (error as Error).message;
  }
  try {
    return (await hasStopped()) ? null : 'The service has taken the stop, but the machine does not say that it stands.';
  } catch {
    return 'The service has taken the stop, but does not say what the machine does.';
  }
}

/** The good news goes when the machine is about something else. */
function forgetLater(): void {
  const confirmed_ms = performance.now();
  forget = store.subscribe(() => {
    const { status } = store.state;
    if (status?.state === 'faulted' || performance.now() - confirmed_ms < SETTLES_MS) return;
    dismissStop();
  });
}

/** Ends the tries, and what is said of them. */
export function dismissStop(): void {
  presses++;
  forget();
  forget = () => {};
  if (store.state.stop) say(null);
}

/** Stops the machine. Each press is sent at once, whatever became of those before. */
export async function emergencyStop(): Promise<void> {
  dismissStop();
  const press = ++presses;
  say({ phase: 'asked', reason: null });
  for (;;) {
    const reason = await attempt();
    if (press !== presses) return;
    if (reason === null) break;
    say({ phase: 'unconfirmed', reason });
    await after(AGAIN_MS);
    if (press !== presses) return;
  }
  say({ phase: 'confirmed', reason: null });
  forgetLater();
}
