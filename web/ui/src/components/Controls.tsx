import { useEffect, useState } from 'preact/hooks';
import { act } from '../api';
import { useStore } from '../hooks';
import { ask, isRunning, lacks } from '../store';
import type { MachineState } from '../types';
import { Icon } from './Icon';
import { Refusal } from './Refusal';
import { AsOf } from './Silence';

const STEPS_MM = [0.1, 1, 10, 50];
const Z_STEP_MAX_MM = 10; // the slow axis: one press is never more than some seconds
type Axis = 'x' | 'y' | 'z' | 'e';
const jog = (axis: Axis, mm: number) => act('jog', 'POST', 'machine/jog', { [`${axis}_mm`]: mm });
const home = (axes: string) => act('jog', 'POST', 'machine/home', { axes });

/** What may be done by hand now. `homed` has a digit for each axis: 1 when its place is known. */
interface Hand {
  mayJog: boolean;
  mayHome: boolean;
  homed: string;
}

function JogPad({ step, hand }: { step: number; hand: Hand }) {
  const z = Math.min(step, Z_STEP_MAX_MM);
  const button = (text: string, axis: Axis, mm: number, area: string) => {
    const known = hand.homed['xyz'.indexOf(axis)] === '1';
    return (
      <button class={`jog ${area}`} disabled={!hand.mayJog || !known} title={known ? undefined : `${axis.toUpperCase()} is not homed: its place is not known`}
        aria-label={`${axis.toUpperCase()} ${mm > 0 ? 'plus' : 'minus'} ${Math.abs(mm)} mm`} onClick={() => jog(axis, mm)}>{text}</button>
    );
  };
  return (
    <div class="jog-pad">
      {button('Y+', 'y', step, 'up')}
      {button('X−', 'x', -step, 'left')}
      <button class="jog centre" disabled={!hand.mayHome} onClick={() => home('xyz')} aria-label="Home all axes" title="Home all axes"><Icon name="home" size={20} /></button>
      {button('X+', 'x', step, 'right')}
      {button('Y−', 'y', -step, 'down')}
      {button('Z+', 'z', z, 'zup')}
      {button('Z−', 'z', -z, 'zdown')}
    </div>
  );
}

/** Why the buttons above cannot be pressed, and the one that mends it. */
function Unhomed({ hand }: { hand: Hand }) {
  const axes = ['x', 'y', 'z'].filter((_, i) => hand.homed[i] !== '1');
  if (axes.length === 0 || !(hand.mayJog || hand.mayHome)) return null;
  const names = axes.map((axis) => axis.toUpperCase());
  const list = names.length > 1 ? `${names.slice(0, -1).join(', ')} and ${names[names.length - 1]} are` : `${names[0]} is`;
  return (
    <div class="reason" data-testid="unhomed">
      <p>{list} not homed: jog waits until the bounds are known.</p>
      <button disabled={!hand.mayHome} onClick={() => home(axes.join(''))}>Home {names.join(' ')}</button>
    </div>
  );
}

function Filament({ step, mayJog }: { step: number; mayJog: boolean }) {
  const length = Math.min(step, 10);
  const { cold, min_c } = useStore((s) => {
    const min = s.config?.hot_end.min_extrude_c ?? 170;
    return { cold: (s.status?.hot_end.c ?? 0) < min || s.status?.hot_end.reading === false, min_c: min };
  });
  return (
    <>
      <div class="segmented">
        <button disabled={!mayJog || cold} onClick={() => jog('e', -length)}>Retract {length} mm</button>
        <button disabled={!mayJog || cold} onClick={() => jog('e', length)}>Extrude {length} mm</button>
      </div>
      {mayJog && cold && <p class="muted small-note">The hot end is too cold to move filament: {min_c} °C at least.</p>}
    </>
  );
}

function Jog({ hand }: { hand: Hand }) {
  const [step, setStep] = useState(10);
  return (
    <>
      <div class="segmented" role="group" aria-label="Distance of one jog">
        {STEPS_MM.map((mm) => (
          <button key={mm} aria-pressed={mm === step} aria-label={`${mm} mm`} class={mm === step ? 'on' : ''} onClick={() => setStep(mm)}>{mm}</button>
        ))}
        <span class="muted">mm</span>
      </div>
      <JogPad step={step} hand={hand} />
      <Unhomed hand={hand} />
      <div class="segmented">
        {['x', 'y', 'z'].map((axis) => (
          <button key={axis} disabled={!hand.mayHome} onClick={() => home(axis)}>Home {axis.toUpperCase()}</button>
        ))}
      </div>
      <Filament step={step} mayJog={hand.mayJog} />
      <Refusal at="jog" />
    </>
  );
}

function Heat({ name, field, target, maximum }: { name: string; field: string; target: number; maximum: number }) {
  const [text, setText] = useState('');
  useEffect(() => setText(target > 0 ? String(Math.round(target)) : ''), [target]);
  const prints = useStore((s) => s.jobs.some(isRunning));
  const post = (value: number) => act(field, 'POST', 'machine/temperature', { [field]: value });
  // A print needs its heat: one wrong press must not take it away.
  const set = async (value: number) => {
    const asks = prints && target > 0 && value <= 0;
    const text = `Switch the ${name.toLowerCase()} off in the middle of the print? The print is paused then, and heats up again first when it is resumed.`;
    if (!asks || (await ask(text, 'Switch it off', (s) => s.jobs.some(isRunning)))) return post(value);
    setText(target > 0 ? String(Math.round(target)) : '');
  };
  return (
    <>
      <form class="heat" onSubmit={(event) => (event.preventDefault(), void set(Number(text) || 0))}>
        <label>{name}
          <span class="field"><input type="number" inputMode="numeric" min={0} max={Math.floor(maximum)} value={text} placeholder="off"
            onInput={(event) => setText(event.currentTarget.value)} aria-label={`${name} target, °C`} /> °C</span>
        </label>
        <button type="submit" aria-label={`Set ${name.toLowerCase()} target`}>Set</button>
        <button type="button" disabled={target <= 0} onClick={() => void set(0)} aria-label={`${name} off`}>Off</button>
      </form>
      <Refusal at={field} />
    </>
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

const NOTES: Partial<Record<MachineState, string>> = {
  starting: 'The machine starts.', printing: 'Axes move by hand when nothing prints, or while a print is paused.',
  pausing: 'Axes move by hand once the head is parked.', paused: 'Axes move by hand once the head is parked.',
  cancelling: 'Axes move by hand when the print has ended.', faulted: 'Axes move by hand once the fault is cleared.',
};

function NoControls() {
  return (
    <div class="card controls" data-testid="no-hand">
      <div class="row head"><h2>Controls</h2><Position /></div>
      <p class="muted">This printer prints files alone: it takes no jog, no temperature and no typed line.</p>
    </div>
  );
}

export function Controls() {
  return useStore((s) => lacks(s, 'hand')) ? <NoControls /> : <ByHand />;
}

function ByHand() {
  const { state, hotEnd, bed, fan } = useStore((s) => ({
    state: s.status?.state ?? 'disconnected', hotEnd: s.status?.hot_end.target_c ?? 0, bed: s.status?.bed.target_c ?? 0,
    fan: Math.round((s.status?.fan ?? 0) * 100),
  }));
  const hand = useStore(({ status }): Hand => ({
    mayJog: status?.connected === true && (status.may_jog || status.state === 'idle'), mayHome: status?.state === 'idle',
    homed: (status?.homed ?? []).map(Number).join(''),
  }));
  const config = useStore((s) => s.config);
  return (
    <div class="card controls">
      <div class="row head"><h2>Controls</h2><Position /></div>
      <AsOf />
      <Jog hand={hand} />
      {!hand.mayJog && NOTES[state] && <p class="muted small-note">{NOTES[state]}</p>}
      <Heat name="Hot end" field="hot_end_c" target={hotEnd} maximum={config?.hot_end.max_c ?? 260} />
      {config?.bed.present !== false && <Heat name="Bed" field="bed_c" target={bed} maximum={config?.bed.max_c ?? 110} />}
      <label class="fan-row">Fan
        <input type="range" min={0} max={100} value={fan} aria-label="Fan, percent"
          onChange={(event) => act('fan', 'POST', 'machine/fan', { duty: Number(event.currentTarget.value) / 100 })} />
        <output>{fan} %</output>
      </label>
      <Refusal at="fan" />
    </div>
  );
}
