import type { JSX } from 'preact';
import { useRef, useEffect } from 'preact/hooks';
import { loadGuarantee } from '../api';
import * as format from '../format';
import { useStore, useStoreSlowly } from '../hooks';
import type { Guarantee, ServiceVcpu, Timing as TimingData, TreeGuarantee } from '../types';

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

function Held({ guarantee }: { guarantee: Guarantee | null }) {
  if (!guarantee) return null;
  const mark = (yes: boolean) => <span class={yes ? 'yes' : 'no'} role="img" aria-label={yes ? 'enforced' : 'not enforced'}>{yes ? '✓' : '✗'}</span>;
  const shortfalls = guarantee.loops.filter((loop) => loop.shortfall);
  return (
    <>
      <h3>What is guaranteed <span class="muted">· {guarantee.board}</span></h3>
      <div class="table-wrap">
        <table>
          <thead><tr><th>Loop</th><th>Core</th><th>Budget / period</th><th>Priority</th><th>Budget</th><th>Owned</th></tr></thead>
          <tbody>
            {guarantee.loops.map((loop) => (
              <tr key={loop.id}>
                <td>{loop.id}</td><td>{loop.core}</td>
                <td>{format.nanoseconds(loop.budget_us * 1000)} / {format.nanoseconds(loop.period_us * 1000)}</td>
                <td>{mark(loop.priority_enforced)}</td><td>{mark(loop.budget_enforced)}</td><td>{loop.core_owned ? '✓' : '–'}</td>
              </tr>
            ))}
          </tbody>
        </table>
      </div>
      <Trees guarantee={guarantee} mark={mark} />
      {shortfalls.map((loop) => <p class="muted shortfall" key={loop.id}>Loop {loop.id}: {loop.shortfall}</p>)}
      {guarantee.cores.map((core) => (
        <p class="muted shortfall" key={core.core}>
          Core {core.core}: {core.interrupts_per_second === null ? 'interrupts not measured' : `${core.interrupts_per_second.toFixed(0)} interrupts/s`}
          {core.worst_gap_us !== null && `, worst gap of a bare spin ${format.nanoseconds(core.worst_gap_us * 1000)}`}
          {core.note && `. ${core.note}`}
        </p>
      ))}
    </>
  );
}

function Figures({ timing }: { timing: TimingData }) {
  const l = timing.lateness_ns;
  const figure = (name: string, value: string, title: string, bad = false) => (
    <div title={title}><dt>{name}</dt><dd class={bad ? 'bad' : ''}>{value}</dd></div>
  );
  return (
    <dl class="figures four">
      {figure('Steps', format.briefCount(l.count), `${format.count(l.count)} pulses sent in this session`)}
      {figure('Median', format.nanoseconds(l.p50), 'Half of all steps were at most so late')}
      {figure('p99', format.nanoseconds(l.p99), '99 % of all steps were at most so late')}
      {figure('p99.99', format.nanoseconds(l.p9999), '99.99 % of all steps were at most so late')}
      {figure('Worst', format.nanoseconds(l.max), 'The latest step', l.max > 1e6)}
      {figure('Late steps', format.briefCount(timing.late_steps), 'Steps later than 1 µs: each moved the time line, none was bunched', timing.late_steps > 0)}
      {figure('Stretch', format.nanoseconds(timing.shift_ns), 'How much longer the print has become by lateness')}
      {figure('Ran dry', format.count(timing.starved), 'Times the step buffer was empty in mid-move', timing.starved > 0)}
    </dl>
  );
}

export function Timing() {
  const timing = useStoreSlowly(500, (s) => (s.status?.connected ? s.status.timing : null));
  const guarantee = useStore((s) => s.guarantee);
  const measured = Boolean(guarantee?.service?.enforced);
  useEffect(() => {
    if (!measured) return;
    const timer = setInterval(() => void loadGuarantee(), 5000);
    return () => clearInterval(timer);
  }, [measured]);
  const absent = useStore((s) => s.status?.connected === false);
  return (
    <div class="card timing" data-testid="timing">
      <h2>Timing <span class="muted">· how late each step was</span></h2>
      {timing && <Figures timing={timing} />}
      {timing && <Histogram buckets={timing.lateness_ns.buckets} />}
      {absent && <p class="muted empty">No machine is connected.</p>}
      <Held guarantee={guarantee} />
    </div>
  );
}
