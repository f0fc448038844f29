import type { JSX } from 'preact';
import { useRef, useEffect } from 'preact/hooks';
import { loadGuarantee } from '../api';
import * as format from '../format';
import { useStore, useStoreSlowly } from '../hooks';
import { lacks } from '../store';
import type { ChainGuarantee, Guarantee, LoopGuarantee, ServiceVcpu, Timing as TimingData, TreeGuarantee } from '../types';

/**
 * Steps by their lateness, one bar for each power of two; heights are logarithmic, or nobody would
 * see the late ones.
 */
export function bars(buckets: [number, number][]): { upTo_ns: number; count: number }[] {
  const sums = new Map<number, number>();
  for (const [upper, count] of buckets) {
    const power = Math.max(4, Math.ceil(Math.log2(Math.max(1, upper + 1))));
    sums.set(power, (sums.get(power) ?? 0) + count);
  }
  if (sums.size === 0) return [];
  const out = [];
  for (let power = Math.min(...sums.keys()); power <= Math.max(...sums.keys()); power++) {
    out.push({ upTo_ns: 2 ** power, count: sums.get(power) ?? 0 });
  }
  return out;
}

function Histogram({ buckets }: { buckets: [number, number][] }) {
  const list = bars(buckets);
  const box = useRef<HTMLDivElement>(null);
  useEffect(() => {
    const highest = Math.max(1, ...list.map((bar) => Math.log10(1 + bar.count)));
    box.current?.querySelectorAll<HTMLElement>('.bar i').forEach((bar, i) => {
      bar.style.height = `${(Math.log10(1 + list[i].count) / highest) * 100}%`;
    });
  });
  if (list.length === 0) return <p class="muted empty">No step yet in this session.</p>;
  return (
    <div class="histogram" ref={box} role="img" aria-label="Steps by lateness">
      {list.map((bar) => (
        <div class={`bar ${bar.upTo_ns > 1024 ? 'late' : ''}`} key={bar.upTo_ns} title={`up to ${format.nanoseconds(bar.upTo_ns)}: ${format.count(bar.count)} steps`}>
          <i /><span>{format.nanoseconds(bar.upTo_ns).replace(/\.\d+/, '')}</span>
        </div>
      ))}
    </div>
  );
}

const PERCENT = (share: number) => `${(share * 100).toFixed(share < 0.1 ? 1 : 0)} %`;

/** What process trees are promised on the loops' cores; the print service with what it uses. */
function Trees({ guarantee, mark }: { guarantee: Guarantee; mark: (yes: boolean) => JSX.Element }) {
  const { service, trees = [] } = guarantee;
  const others = trees.filter((tree) => tree.name !== service?.name);
  const rows: (TreeGuarantee | ServiceVcpu)[] = service ? [service, ...others] : others;
  const held = rows.filter((tree) => tree.budget_us > 0);
  return (
    <div data-testid="trees">
      {held.length > 0 && (
        <div class="table-wrap">
          <table>
            <thead><tr><th>Process</th><th>Core</th><th>Budget / period</th><th>Held</th><th>Uses</th></tr></thead>
            <tbody>
              {held.map((tree) => (
                <tr key={tree.name}>
                  <td>{tree.name}</td><td>{tree.core}</td>
                  <td>{format.nanoseconds(tree.budget_us * 1000)} / {format.nanoseconds(tree.period_us * 1000)}</td>
                  <td title={'enforced_by' in tree ? tree.enforced_by ?? '' : ''}>{mark(tree.admitted && tree.enforced)}</td>
                  <td>{'used_share' in tree ? PERCENT(tree.used_share) : '–'}</td>
                </tr>
              ))}
            </tbody>
          </table>
        </div>
      )}
      {rows.filter((tree) => tree.shortfall).map((tree) => (
        <p class="muted shortfall" key={tree.name}>{tree.budget_us > 0 ? `${tree.name}: ` : `The ${tree.name} has no budget: `}{tree.shortfall}</p>
      ))}
    </div>
  );
}

/** A shorter stretch says little: the kernel tells a thread's CPU time by its ticks. */
const STRETCH_US = 1e6;

/**
 * The share of its core that a loop has used: since the report before, or, where that is not of the
 * same run or just made, since the loops began. Null: nobody watches it.
 */
export function usedShare(now: LoopGuarantee, before?: LoopGuarantee): number | null {
  if (now.cpu_used_us === null || !now.watched_us) return null;
  const used = now.cpu_used_us - (before?.cpu_used_us ?? 0);
  const lasted = now.watched_us - (before?.watched_us ?? 0);
  return lasted >= STRETCH_US && used >= 0 ? used / lasted : now.cpu_used_us / now.watched_us;
}

/** How a loop has kept its periods: "✓", or how many it has not. */
export function periodsOf(loop: LoopGuarantee): { text: string; title: string; bad: boolean } {
  if (loop.releases === null || loop.releases < 2) return { text: '–', title: 'It does not wait for periods', bad: false };
  const late = (loop.overruns ?? 0) + (loop.missed ?? 0);
  const worst = loop.worst_late_us ? `, the worst by ${format.nanoseconds(loop.worst_late_us * 1000)}` : '';
  const stuck = loop.missed ? `; it is in one for ${format.count(loop.missed)} periods now` : '';
  return {
    text: late > 0 ? `${format.briefCount(late)} late` : '✓',
    title: `${format.count(loop.releases)} releases, ${format.count(loop.overruns ?? 0)} late${worst}${stuck}`,
    bad: late > 0,
  };
}

/** The loops of sketches/printer, and its bottom halves in the order in which it declares them. */
const LOOP_NAMES: Record<number, string> = { 1: 'plan', 2: 'step', 3: 'heat', 33: 'I2C', 34: 'network', 35: 'serial' };

function LoopRow({ loop, before, mark }: { loop: LoopGuarantee; before?: LoopGuarantee; mark: (yes: boolean) => JSX.Element }) {
  const share = usedShare(loop, before);
  const periods = periodsOf(loop);
  return (
    <tr>
      <td>{loop.id}{LOOP_NAMES[loop.id] && <small> {LOOP_NAMES[loop.id]}</small>}</td><td>{loop.core}</td>
      <td>{format.nanoseconds(loop.budget_us * 1000)} / {format.nanoseconds(loop.period_us * 1000)}</td>
      <td>{mark(loop.priority_enforced)}</td><td>{mark(loop.budget_enforced)}</td><td>{loop.core_owned ? '✓' : '–'}</td>
      <td title={share === null ? 'Nobody watches it' : 'Of its core'}>{share === null ? '–' : PERCENT(share)}</td>
      <td class={periods.bad ? 'bad' : ''} title={periods.title}>{periods.text}</td>
    </tr>
  );
}

/** The worst that was seen of a chain against its bound: "8.52 ms of 15.6 ms". */
export function chainTimes(worst_us: number | null, bound_us: number | null): { text: string; bad: boolean } {
  if (bound_us === null) return { text: '–', bad: false };
  const seen = worst_us === null ? '–' : format.nanoseconds(worst_us * 1000);
  return { text: `${seen} of ${format.nanoseconds(bound_us * 1000)}`, bad: worst_us !== null && worst_us > bound_us };
}

/** What a chain's reaction is, for a person who points at it. */
export function chainTitle(chain: ChainGuarantee): string {
  const within = chain.reaction_limit_us === null ? '' : `; the sketch asks for ${format.nanoseconds(chain.reaction_limit_us * 1000)}`;
  const from = chain.from_first_loop ? ', seen from its first loop on' : '';
  return `From a change of the input to the output that answers it${within}: ${format.count(chain.reactions)} reactions${from}`;
}

/** From input to output: the worst that was seen, of what admission bounds. */
function Chains({ chains }: { chains: ChainGuarantee[] }) {
  if (chains.length === 0) return null;
  const times = (worst: number | null, bound: number | null, title: string) => {
    const { text, bad } = chainTimes(worst, bound);
    return <td class={bad ? 'bad' : ''} title={title}>{text}</td>;
  };
  return (
    <div class="table-wrap" data-testid="chains">
      <table>
        <thead><tr><th>Chain</th><th>Reaction</th><th>Age of data</th></tr></thead>
        <tbody>
          {chains.map((chain) => (
            <tr key={chain.name}>
              <td class="chain" title={chain.way}>{chain.name}<small class="muted">{chain.way}</small></td>
              {times(chain.worst_reaction_us, chain.reaction_bound_us, chainTitle(chain))}
              {times(chain.worst_age_us, chain.age_bound_us, 'From when an input was read to when the output that rests on it was written')}
            </tr>
          ))}
        </tbody>
      </table>
    </div>
  );
}

/** "250 interrupts/s of 375 that are counted, worst gap of a bare spin 21 µs." */
function coreLine(core: Guarantee['cores'][number]): string {
  const counted = core.counted_per_second === null ? '' : ` of ${core.counted_per_second.toFixed(0)} that are counted`;
  const interrupts = core.interrupts_per_second === null ? 'interrupts not measured' : `${core.interrupts_per_second.toFixed(0)} interrupts/s${counted}`;
  const gap = core.worst_gap_us === null ? '' : `, worst gap of a bare spin ${format.nanoseconds(core.worst_gap_us * 1000)}`;
  return `Core ${core.core}: ${interrupts}${gap}${core.note && `. ${core.note}`}`;
}

function Held({ guarantee, before }: { guarantee: Guarantee | null; before: Guarantee | null }) {
  if (!guarantee) return null;
  const mark = (yes: boolean) => <span class={yes ? 'yes' : 'no'} role="img" aria-label={yes ? 'enforced' : 'not enforced'}>{yes ? '✓' : '✗'}</span>;
  return (
    <>
      <h3>What is guaranteed <span class="muted">· {guarantee.board}</span></h3>
      <div class="table-wrap loops" data-testid="loops">
        <table>
          <thead><tr><th>Loop</th><th>Core</th><th>Budget / period</th><th>Priority</th><th>Budget</th><th>Owned</th><th>Uses</th><th>Periods</th></tr></thead>
          <tbody>
            {guarantee.loops.map((loop) => <LoopRow key={loop.id} loop={loop} before={before?.loops.find(({ id }) => id === loop.id)} mark={mark} />)}
          </tbody>
        </table>
      </div>
      <Chains chains={guarantee.chains ?? []} />
      <Trees guarantee={guarantee} mark={mark} />
      {guarantee.loops.filter((loop) => loop.escape || loop.shortfall).map((loop) => (
        <p class={loop.escape ? 'bad shortfall' : 'muted shortfall'} key={loop.id}>
          Loop {loop.id}{LOOP_NAMES[loop.id] ? ` (${LOOP_NAMES[loop.id]})` : ''}: {[loop.escape, loop.shortfall].filter(Boolean).join('; ')}
        </p>
      ))}
      {guarantee.cores.map((core) => <p class="muted shortfall" key={core.core}>{coreLine(core)}</p>)}
    </>
  );
}

/** `simulated`: its steps cannot be late, so there is nothing to measure. */
function Figures({ timing, simulated }: { timing: TimingData; simulated: boolean }) {
  const l = timing.lateness_ns;
  const known = l.count > 0 && !simulated;
  const time = (ns: number) => (known ? format.nanoseconds(ns) : '–');
  const figure = (name: string, value: string, title: string, bad = false) => (
    <div title={title}><dt>{name}</dt><dd class={bad ? 'bad' : ''}>{value}</dd></div>
  );
  return (
    <dl class="figures four">
      {figure('Steps', format.briefCount(l.count), `${format.count(l.count)} pulses sent in this session`)}
      {figure('Median', time(l.p50), 'Half of all steps were at most so late')}
      {figure('p99', time(l.p99), '99 % of all steps were at most so late')}
      {figure('p99.99', time(l.p9999), '99.99 % of all steps were at most so late')}
      {figure('Worst', time(l.max), 'The latest step', known && l.max > 1e6)}
      {figure('Late steps', known ? format.briefCount(timing.late_steps) : '–', 'Steps later than 1 µs: each moved the time line, none was bunched', timing.late_steps > 0)}
      {figure('Stretch', time(timing.shift_ns), 'How much longer the print has become by lateness')}
      {figure('Ran dry', known ? format.count(timing.starved) : '–', 'Times the step buffer was empty in mid-move', timing.starved > 0)}
    </dl>
  );
}

export function Timing() {
  const timing = useStoreSlowly(500, (s) => (s.status?.connected ? s.status.timing : null));
  const { guarantee, guaranteeBefore } = useStore((s) => ({ guarantee: s.guarantee, guaranteeBefore: s.guaranteeBefore }));
  const connected = useStore((s) => Boolean(s.status?.connected) && !lacks(s, 'guarantee'));
  useEffect(() => {
    if (!connected) return;
    const timer = setInterval(() => void loadGuarantee(), 5000);
    return () => clearInterval(timer);
  }, [connected]);
  const simulated = guarantee?.simulated === true;
  const absent = useStore((s) => s.status?.connected === false);
  return (
    <div class="card timing" data-testid="timing">
      <h2>Timing <span class="muted">· how late each step was</span></h2>
      {timing && <Figures timing={timing} simulated={simulated} />}
      {timing && !simulated && <Histogram buckets={timing.lateness_ns.buckets} />}
      {timing && simulated && <p class="muted empty" data-testid="no-lateness">This printer is simulated: each step comes at its instant. On a real one its lateness is measured.</p>}
      {absent && <p class="muted empty">No machine is connected.</p>}
      <Held guarantee={guarantee} before={guaranteeBefore} />
    </div>
  );
}
