import { useEffect } from 'preact/hooks';
import { act } from '../api';
import * as format from '../format';
import { useStore } from '../hooks';
import { isRunning, progressOf } from '../store';

const STATE_WORDS: Record<string, string> = {
  disconnected: 'Disconnected', starting: 'Starting', idle: 'Ready', printing: 'Printing', pausing: 'Pausing',
  paused: 'Paused', cancelling: 'Cancelling', faulted: 'Stopped by a fault', offline: 'Not reached',
};

export function Header() {
  const { state, message, title } = useStore((s) => {
    const job = s.jobs.find(isRunning);
    return {
      state: !s.online ? 'offline' : (s.status?.state ?? 'disconnected'),
      message: s.status?.message ?? '',
      title: job ? `${format.wholePercent(progressOf(job, s.status).fraction)} · ${job.name}` : 'QduinoMC printer',
    };
  });
  useEffect(() => {
    document.title = title;
  }, [title]);
  return (
    <header class="top">
      <img src="/icon.svg" alt="" width="32" height="32" />
      <strong class="brand">QduinoMC</strong>
      <span class={`chip state-${state}`} data-testid="state" role="status">{STATE_WORDS[state]}</span>
      {message && <span class="message" title="Message of the job">{message}</span>}
      <button class="emergency" onClick={() => act('POST', 'machine/emergency-stop')} title="Heat off and no more motion, at once">
        Emergency stop
      </button>
    </header>
  );
}
