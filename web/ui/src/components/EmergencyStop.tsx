import { useStore } from '../hooks';
import { dismissStop, emergencyStop } from '../stop';
import { Icon } from './Icon';

/** Stands in the header, which no question and no notice ever covers. */
export function EmergencyStop() {
  return (
    <button class="emergency" onClick={() => void emergencyStop()} title="Heat off and no more motion, at once">
      Emergency stop
    </button>
  );
}

/** What became of the stop. It stays below the header until the machine is about something else. */
export function StopNote() {
  const stop = useStore((s) => s.stop);
  if (!stop) return null;
  return (
    <div class={`stop-note ${stop.phase}`} data-testid="stop" data-phase={stop.phase}>
      <Icon name={stop.phase === 'confirmed' ? 'check' : 'warning'} size={22} />
      <p role="alert">
        {stop.phase === 'asked' && <strong>Stopping …</strong>}
        {stop.phase === 'confirmed' && <><strong>Stopped, confirmed.</strong> The machine says that heat and motion are off.</>}
        {stop.phase === 'unconfirmed' && <><strong>NOT confirmed: cut the power.</strong> {stop.reason} This page keeps trying.</>}
      </p>
      {stop.phase !== 'asked' && (
        <button class="quiet" onClick={dismissStop} aria-label={stop.phase === 'unconfirmed' ? 'Stop trying' : 'Dismiss'}><Icon name="cross" /></button>
      )}
    </div>
  );
}
