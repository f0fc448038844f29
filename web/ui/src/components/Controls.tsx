import { useEffect, useState } from 'preact/hooks';
import { act } from '../api';
import { useStore } from '../hooks';
import { Icon } from './Icon';

const STEPS_MM = [0.1, 1, 10, 50];
const Z_STEP_MAX_MM = 10; // the slow axis: one press is never more than some seconds
type Axis = 'x' | 'y' | 'z' | 'e';
const jog = (axis: Axis, mm: number) => act('POST', 'machine/jog', { [`${axis}_mm`]: mm });
const home = (axes: string) => act('POST', 'machine/home', { axes });

function JogPad({ step, disabled }: { step: number; disabled: boolean }) {
  const z = Math.min(step, Z_STEP_MAX_MM);
  const button = (text: string, axis: Axis, mm: number, area: string) => (
    <button class={`jog ${area}`} disabled={disabled} aria-label={`${axis.toUpperCase()} ${mm > 0 ? 'plus' : 'minus'} ${Math.abs(mm)} mm`}
      onClick={() => jog(axis, mm)}>{text}</button>
  );
  return (
    <div class="jog-pad">
      {button('Y+', 'y', step, 'up')}
      {button('X−', 'x', -step, 'left')}
      <button class="jog centre" disabled={disabled} onClick={() => home('xyz')} aria-label="Home all axes" title="Home all axes"><Icon name="home" size={20} /></button>
      {button('X+', 'x', step, 'right')}
      {button('Y−', 'y', -step, 'down')}
      {button('Z+', 'z', z, 'zup')}
      {button('Z−', 'z', -z, 'zdown')}
    </div>
  );
}

function Jog({ disabled }: { disabled: boolean }) {
  const [step, setStep] = useState(10);
  const cold = useStore((s) => (s.status?.hot_end.c ?? 0) < (s.config?.hot_end.min_extrude_c ?? 170));
  const length = Math.min(step, 10);
  return (
    <>
      <div class="segmented" role="group" aria-label="Distance of one jog">
        {STEPS_MM.map((mm) => (
          <button key={mm} aria-pressed={mm === step} class={mm === step ? 'on' : ''} onClick={() => setStep(mm)}>{mm}</button>
        ))}
        <span class="muted">mm</span>
      </div>
      <JogPad step={step} disabled={disabled} />
      <div class="segmented">
        {['x', 'y', 'z'].map((axis) => (
          <button key={axis} disabled={disabled} onClick={() => home(axis)}>Home {axis.toUpperCase()}</button>
        ))}
      </div>
      <div class="segmented" title={cold ? 'The hot end is too cold to move filament' : undefined}>
        <button disabled={disabled || cold} onClick={() => jog('e', -length)}>Retract {length} mm</button>
        <button disabled={disabled || cold} onClick={() => jog('e', length)}>Extrude {length} mm</button>
      </div>
    </>
  );
}

function Heat({ name, field, target, maximum }: { name: string; field: string; target: number; maximum: number }) {
  const [text, setText] = useState('');
  useEffect(() => setText(target > 0 ? String(Math.round(target)) : ''), [target]);
  const set = (value: number) => act('POST', 'machine/temperature', { [field]: value });
  return (
    <form class="heat" onSubmit={(event) => (event.preventDefault(), void set(Number(text) || 0))}>
      <label>{name}
        <span class="field"><input type="number" inputMode="numeric" min={0} max={Math.floor(maximum)} value={text} placeholder="off"
          onInput={(event) => setText(event.currentTarget.value)} aria-label={`${name} target, °C`} /> °C</span>
      </label>
      <button type="submit">Set</button>
      <button type="button" disabled={target <= 0} onClick={() => set(0)} aria-label={`${name} off`}>Off</button>
    </form>
  );
}

function Position() {
  const { homed, ...place } = useStore((s) => ({
    x: s.status?.position_mm.x.toFixed(2) ?? '–', y: s.status?.position_mm.y.toFixed(2) ?? '–', z: s.status?.position_mm.z.toFixed(3) ?? '–',
    homed: (s.status?.homed ?? []).map(Number).join(''),
  }));
  return (
    <div class="position" data-testid="position">
      {(['x', 'y', 'z'] as const).map((axis, i) => (
        <span key={axis} class={homed[i] === '1' ? '' : 'unhomed'} title={homed[i] === '1' ? 'homed' : 'not homed'}>
          {axis.toUpperCase()} <b>{place[axis]}</b>
        </span>
      ))}
    </div>
  );
}

export function Controls() {
  const { state, hotEnd, bed, fan } = useStore((s) => ({
    state: s.status?.state ?? 'disconnected', hotEnd: s.status?.hot_end.target_c ?? 0, bed: s.status?.bed.target_c ?? 0,
    fan: Math.round((s.status?.fan ?? 0) * 100),
  }));
  const config = useStore((s) => s.config);
  const busy = state !== 'idle';
  return (
    <div class="card controls">
      <div class="row head"><h2>Controls</h2><Position /></div>
      <Jog disabled={busy} />
      <Heat name="Hot end" field="hot_end_c" target={hotEnd} maximum={config?.hot_end.max_c ?? 260} />
      {config?.bed.present !== false && <Heat name="Bed" field="bed_c" target={bed} maximum={config?.bed.max_c ?? 110} />}
      <label class="fan-row">Fan
        <input type="range" min={0} max={100} value={fan} aria-label="Fan, percent"
          onChange={(event) => act('POST', 'machine/fan', { duty: Number(event.currentTarget.value) / 100 })} />
        <output>{fan} %</output>
      </label>
      {busy && state !== 'disconnected' && state !== 'faulted' && <p class="muted">Axes move by hand when nothing prints.</p>}
    </div>
  );
}
