// Numbers as people read them. Pure.

/** 4804 → "1 h 20 min"; 754 → "13 min"; 61 → "1 min 01 s"; null → "–". */
export function duration(seconds: number | null | undefined): string {
  if (seconds === null || seconds === undefined || !Number.isFinite(seconds) || seconds < 0) return '–';
  const s = Math.round(seconds);
  const h = Math.floor(s / 3600);
  const m = Math.floor((s % 3600) / 60);
  if (h > 0) return `${h} h ${String(m).padStart(2, '0')} min`;
  if (m >= 10) return `${Math.round(s / 60)} min`;
  if (m > 0) return `${m} min ${String(s % 60).padStart(2, '0')} s`;
  return `${s} s`;
}

/** 3482129 → "3.5 MB". */
export function bytes(count: number): string {
  if (count < 1000) return `${count} B`;
  const units = ['KB', 'MB', 'GB', 'TB'];
  let value = count;
  let unit = -1;
  do {
    value /= 1000;
    unit++;
  } while (value >= 999.5 && unit < units.length - 1);
  return `${value < 10 ? value.toFixed(1) : Math.round(value)} ${units[unit]}`;
}

/** 1500 → "1.5 µs"; 12 → "12 ns"; 51000000 → "51 ms". */
export function nanoseconds(ns: number): string {
  const sign = ns < 0 ? '−' : '';
  const n = Math.abs(ns);
  const [value, unit] = n < 1000 ? [n, 'ns'] : n < 1e6 ? [n / 1e3, 'µs'] : n < 1e9 ? [n / 1e6, 'ms'] : [n / 1e9, 's'];
  const text = unit === 'ns' || value >= 100 ? Math.round(value).toString() : value >= 10 ? value.toFixed(1) : value.toFixed(2);
  return `${sign}${text} ${unit}`;
}

/** 1234567 → "1 234 567", with narrow spaces. */
export function count(n: number): string {
  return Math.round(n).toString().replace(/\B(?=(\d{3})+(?!\d))/g, '\u202f');
}

/** 1234567 → "1.23 M": where the place is narrow and the rest stands in a title. */
export function briefCount(n: number): string {
  if (n < 100_000) return count(n);
  const [value, unit] = n < 999_500 ? [n / 1e3, 'k'] : n < 999.5e6 ? [n / 1e6, 'M'] : [n / 1e9, 'G'];
  return `${value.toPrecision(3)} ${unit}`;
}

/** The service's texts begin in lower case, as parts of a log line do. */
export const sentence = (text: string): string => text.charAt(0).toUpperCase() + text.slice(1);

/**
 * Characters that turn the direction of the text around them, and that nobody sees: with one of
 * them a name may look like another.
 */
const UNSEEN = /[\u0000-\u001f\u007f-\u009f\u00ad\u061c\u200b\u200e\u200f\u2028-\u202e\u2060-\u206f\ufeff]/g;

/** A text of somebody else's, with such characters in words: "a‹U+202E›b". */
export const visible = (text: string): string =>
  text.replace(UNSEEN, (c) => `‹U+${c.charCodeAt(0).toString(16).toUpperCase().padStart(4, '0')}›`);

/** A name within a sentence that is text alone: its direction does not reach the words around. */
export const quoted = (name: string): string => `\u2068${visible(name)}\u2069`;

export function percent(fraction: number): string {
  return `${(Math.min(1, Math.max(0, fraction)) * 100).toFixed(fraction > 0 && fraction < 0.1 ? 1 : 0)} %`;
}

/** A progress: never more than what is done, and the same wherever it stands. */
export function done(fraction: number): string {
  const percents = Math.min(1, Math.max(0, fraction)) * 100;
  return `${percents < 10 ? (Math.floor(percents * 10) / 10).toFixed(percents > 0 ? 1 : 0) : Math.floor(percents)} %`;
}

/** As percent, in steps of one: for places that should not flicker. */
export const wholePercent = (fraction: number): string => `${Math.floor(Math.min(1, Math.max(0, fraction)) * 100)} %`;

/** When it will be over, as a time of day. */
export function clock(secondsFromNow: number | null, now: Date): string {
  if (secondsFromNow === null || !Number.isFinite(secondsFromNow)) return '–';
  const at = new Date(now.getTime() + secondsFromNow * 1000);
  return `${String(at.getHours()).padStart(2, '0')}:${String(at.getMinutes()).padStart(2, '0')}`;
}

/** 20 → "20×"; 0.5 → "0.5×". */
export const factor = (times: number): string => `${Number(times.toPrecision(3))}×`;
