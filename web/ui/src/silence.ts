// How old what the page shows is. The service sends a life sign each second, so three seconds
// without a word say that it stands still, or that the way to it is cut: a connection that is open
// says nothing of that. Pure.
//
//     news        news                       3 s                        news
//      │  shown as it is                      │ greyed, "as of 14:30:15" │ shown as it is
import type { State } from './store';

export const SILENT_FROM_S = 3;

/** Whole seconds without news; null: not so long that it is said. `now_ms`: Unix time. */
export function silenceOf(newsAt_ms: number | null, now_ms: number): number | null {
  if (newsAt_ms === null) return null;
  const silent_s = Math.floor((now_ms - newsAt_ms) / 1000);
  return silent_s >= SILENT_FROM_S ? silent_s : null;
}

/** True when what is shown is not of now: nothing may be steered by it but the emergency stop. */
export const isOld = (state: State): boolean => !state.online || state.silent_s !== null;

/** 14:30:15, as the clock on the wall showed it. */
export function clockOf(at_ms: number): string {
  const at = new Date(at_ms);
  return [at.getHours(), at.getMinutes(), at.getSeconds()].map((part) => String(part).padStart(2, '0')).join(':');
}

/** "as of 14:30:15"; null while what is shown is of now, or nothing was ever heard. */
export const asOf = (state: State): string | null =>
  (isOld(state) && state.newsAt_ms !== null ? `as of ${clockOf(state.newsAt_ms)}` : null);
