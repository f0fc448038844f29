import { useEffect } from 'preact/hooks';
import { act } from '../api';
import * as format from '../format';
import { useStore } from '../hooks';
import { isRunning, progressNow } from '../store';

const STATE_WORDS: Record<string, string> = {
  disconnected: 'Disconnected', starting: 'Starting', idle: 'Ready', printing: 'Printing', pausing: 'Pausing',
  paused: 'Paused', cancelling: 'Cancelling', faulted: 'Stopped by a fault', offline: 'Not reached',
};

export function Header() {
  const { state, message, title, factor } = useStore((s) => {
    const job = s.jobs.find(isRunning);
    return {
      state: !s.online ? 'offline' : (s.status?.state ?? 'disconnected'),
      message: s.status?.message ?? '',
      factor: s.status?.connected ? (s.status.time_factor ?? 1) : 1,
      title: job ? `${format.wholePercent(progressNow(job, s.status).fraction)} · ${job.name}` : 'QduinoMC printer',
    };
  });
  useEffect(() => {
    document.title = title;
  }, [title]);
  return (
    <header class="top">
      <img src="/icon.svg" alt="" width="32" height="32" />
      <h1 class="brand">QduinoMC<span class="unseen"> printer</span></h1>
      <span class={`chip state-${state}`} data-testid="state" role="status">{STATE_WORDS[state]}</span>
      {factor !== 1 && (
        <span class="chip factor" data-testid="factor" title={`Not a real printer: its time passes ${format.factor(factor)} as fast as the clock on the wall. Durations on this page are in the printer's time.`}>
          simulated, {format.factor(factor)}
        </span>
      )}
      {message && <span class="message" title="Message of the job">{message}</span>}
      <button class="emergency" onClick={() => act('stop', 'POST', 'machine/emergency-stop')} title="Heat off and no more motion, at once">
        Emergency stop
      </button>
    </header>
  );
}
