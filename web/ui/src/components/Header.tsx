import { useEffect } from 'preact/hooks';
import { doing, tabTitle } from '../doing';
import * as format from '../format';
import { useStore } from '../hooks';
import { isRunning, progressNow, UNNAMED } from '../store';
import { EmergencyStop, StopNote } from './EmergencyStop';
import { Name } from './Name';
import { Phone } from './Phone';
import { SilenceChip } from './Silence';

export function Header() {
  const { state, word, detail, name, message, title, factor } = useStore((s) => {
    const job = s.jobs.find(isRunning) ?? null;
    const now = doing(s.online, s.status);
    const printer = s.config?.name || UNNAMED;
    return {
      ...now, name: printer,
      message: s.status?.message ?? '',
      factor: s.status?.connected ? (s.status.time_factor ?? 1) : 1,
      title: format.visible(tabTitle(now, job, job ? progressNow(job, s.status).fraction : 0, printer)),
    };
  });
  useEffect(() => {
    document.title = title;
  }, [title]);
  return (
    <header class="top">
      <img src="icon.svg" alt="" width="32" height="32" />
      <h1 class="brand" data-testid="printer"><Name>{name}</Name></h1>
      <span class={`chip state-${state}`}>
        <span data-testid="state" role="status">{word}</span>
        {detail && <span class="detail" data-testid="doing"> {detail}</span>}
      </span>
      <SilenceChip />
      {factor !== 1 && (
        <span class="chip factor" data-testid="factor" title={`Not a real printer: its time passes ${format.factor(factor)} as fast as the clock on the wall. Durations on this page are in the printer's time.`}>
          simulated, {format.factor(factor)}
        </span>
      )}
      {message && <span class="message" title="Message of the job"><Name>{message}</Name></span>}
      <Phone />
      <EmergencyStop />
      <StopNote />
    </header>
  );
}
