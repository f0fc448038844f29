// What the printer does just now, in the words of the header and of the tab. Pure.
import * as format from './format';
import { isRunning } from './jobs';
import type { HeaterStatus, Job, Status } from './types';

export interface Doing {
  /** The state's name in the style sheet. */
  state: string;
  word: string;
  /** Numbers, or a remark: they change often, and are not announced. Empty: none. */
  detail: string;
}

const STATE_WORDS: Record<string, string> = {
  disconnected: 'Disconnected', starting: 'Starting', idle: 'Ready', printing: 'Printing', pausing: 'Pausing',
  paused: 'Paused', cancelling: 'Cancelling', faulted: 'Stopped by a fault', offline: 'Not reached',
};

/** A hot end above this burns fingers. */
export const COOL_C = 50;
/** So near its target a heater neither heats nor cools to it. */
const NEAR_C = 2;

/** "143 of 209 °C", on the way there. */
function heating(heater: HeaterStatus, name: string): { word: string; detail: string } {
  const to = Math.round(heater.target_c);
  const word = heater.c > heater.target_c + NEAR_C ? 'Cooling' : 'Heating';
  return { word, detail: `${name}${heater.reading === false ? '–' : Math.round(heater.c)} of ${to} °C` };
}

function activityOf(status: Status): { word: string; detail: string } | null {
  switch (status.activity) {
    case 'homing': return { word: 'Homing', detail: '' };
    case 'probing': return { word: 'Measuring the bed', detail: '' };
    case 'heating_hot_end': return heating(status.hot_end, '');
    case 'heating_bed': return heating(status.bed, 'bed ');
    case 'returning': return { word: 'Going back to the part', detail: '' };
    default: return null;
  }
}

export function doing(online: boolean, status: Status | null): Doing {
  const state = online ? (status?.state ?? 'disconnected') : 'offline';
  const plain = { state, word: STATE_WORDS[state], detail: '' };
  if (!status || !online) return plain;
  const activity = state === 'printing' || state === 'pausing' || state === 'idle' ? activityOf(status) : null;
  if (activity && state !== 'pausing') return { state: state === 'idle' ? 'printing' : state, ...activity };
  if (state === 'paused' && status.parked) return { ...plain, detail: '· parked' };
  const cools = status.hot_end.target_c <= 0 && status.bed.target_c <= 0 && status.hot_end.c >= COOL_C && status.hot_end.reading !== false;
  return state === 'idle' && cools ? { ...plain, detail: `· cooling, ${Math.round(status.hot_end.c)} °C` } : plain;
}

/**
 * The tab's name: what a row of tabs must tell apart stands first. "57 % Printing · Prusa · part".
 */
export function tabTitle(now: Doing, job: Job | null, fraction: number, printer: string): string {
  const running = job && isRunning(job);
  const percent = running ? `${format.wholePercent(fraction)} ` : '';
  return [`${percent}${now.word}`, printer, running ? job.name : ''].filter(Boolean).join(' · ');
}
